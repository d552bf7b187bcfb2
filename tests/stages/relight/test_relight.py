"""The stage relight on a small room."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from PIL import Image

from frozen_store import artifact, frozen_artifact, write_targets
from lit_room import VISIBLE, room_cameras
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import read_image
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import LightRig, PointLight, SpotLight
from rgspipe.stages.base import Need, StageContext
from rgspipe.stages.relight import relight
from rgspipe.stages.relight.scene import target_folders
from rgspipe.store.artifacts import Artifact


def vector(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)


POINT = PointLight(vector(*VISIBLE), vector(1.0, 2.0, 0.5))
SPOT = SpotLight(vector(-0.2, 0.0, 0.35), vector(2.0, 1.0, 1.0), vector(0.0, 0.0, -1.0), "smoothstep", 0.6, 0.2)
RIGS: dict[str, LightRig] = {"one": (POINT,), "other": (SPOT,), "both": (POINT, SPOT)}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Artifact]:
    """The frozen room, and targets whose images the library's own renderer made."""
    root = tmp_path_factory.mktemp("store")
    freeze = frozen_artifact(root)
    views = FitViews.prepare(FrozenScene.load(freeze.folder()), room_cameras(32), sharp=True)
    images = {name: views.render(rig) for name, rig in RIGS.items()}
    return {
        "freeze": freeze,
        "generate_dataset": artifact(root, "generate_dataset", lambda folder: write_targets(folder, images, RIGS)),
    }


def configured(**changes: object) -> RgspipeConfig:
    named = {key.replace("__", "."): value for key, value in changes.items()}
    return with_changes(RgspipeConfig(stage="relight"), named)


def run(inputs: dict[str, Artifact], folder: Path, **changes: object) -> dict:
    folder.mkdir(exist_ok=True)
    context = StageContext(configured(**changes), inputs, {}, folder)
    relight.run(context)
    return json.loads(json.dumps(context.facts, allow_nan=False))


def test_a_light_file_of_points_and_spots_is_shown_in_every_camera(inputs, tmp_path: Path) -> None:
    write_lights(tmp_path / "mixed.json", RIGS["both"])
    facts = run(inputs, tmp_path / "out", relight__lights=str(tmp_path / "mixed.json"))
    table = pd.read_csv(tmp_path / "out" / "relight.csv")
    assert table["rig"].tolist() == ["mixed"] * 2 and table["view"].tolist() == [0, 1]
    assert facts["shows"] == "rig" and facts["images"] == 2 and facts["milliseconds"] > 0.0
    (reasons,) = facts["effects"].values()
    assert list(facts["effects"]) == ["1 point, 1 spot"] and reasons[0].startswith("shadows simulated")
    for view in (0, 1):
        image, _ = read_image(tmp_path / "out" / f"images/mixed/view_{view}.exr")
        truth, _ = read_image(inputs["generate_dataset"].file(f"targets/both/view_{view}.exr"))
        np.testing.assert_allclose(image, truth, atol=1e-6 * truth.max())  # measured 0
    assert [type(light) for light in read_lights(tmp_path / "out" / "lights" / "mixed.json")] == [PointLight, SpotLight]
    assert (tmp_path / "out" / "sheet.png").read_bytes().startswith(b"\x89PNG")


def test_a_random_rig_lights_the_scene_and_follows_its_seed(inputs, tmp_path: Path) -> None:
    for name, seed in (("first", 3), ("again", 3), ("other", 4)):
        run(inputs, tmp_path / name, relight__count=2, relight__seed=seed, relight__indices=[1])
    images = {
        name: read_image(tmp_path / name / f"images/random_{seed}/view_1.exr")[0]
        for name, seed in (("first", 3), ("again", 3), ("other", 4))
    }
    assert np.array_equal(images["first"], images["again"]) and not np.allclose(images["first"], images["other"])
    assert images["first"].mean() > 0.01
    assert len(read_lights(tmp_path / "first/lights/random_3.json")) == 2
    assert pd.read_csv(tmp_path / "first/relight.csv")["view"].tolist() == [1]


def test_true_rigs_are_compared_with_the_images_of_their_targets(inputs, tmp_path: Path) -> None:
    facts = run(inputs, tmp_path / "out", relight__rigs="targets")
    table = pd.read_csv(tmp_path / "out" / "relight.csv")
    assert sorted(zip(table["rig"], table["view"], strict=True)) == sorted(
        (name, view) for name in RIGS for view in (0, 1)
    )
    assert table["psnr"].min() > 90.0, "the images are those of the same renderer"  # measured inf or above 120
    assert table["ssim"].min() > 0.9999 and table["flip"].max() < 1e-3  # measured 1 and 0
    summary = pd.read_csv(tmp_path / "out" / "summary.csv")
    assert summary["lights"].tolist() == [1, 2] and summary["images"].tolist() == [4, 2]
    assert facts["shows"] == "targets" and facts["images"] == 6


def test_what_differs_from_truth_is_measured_and_drawn(inputs, tmp_path: Path) -> None:
    # The same rigs at surfels' centres, beside images with light at pixels.
    run(inputs, tmp_path / "out", relight__rigs="targets", effects__at_pixels=False, relight__indices=[0])
    table = pd.read_csv(tmp_path / "out" / "relight.csv")
    assert len(table) == 3 and table["psnr"].max() < 60.0 and table["psnr"].min() > 10.0
    assert (tmp_path / "out" / "comparison.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("sweep", "frames"), [("aim", 8), ("orbit", 5)])
def test_a_sweep_is_a_strip_a_video_and_a_table(inputs, tmp_path: Path, sweep: str, frames: int) -> None:
    options = {"relight__sweep": sweep, "relight__path__frames": 5, "relight__path__seconds": 1.0}
    facts = run(inputs, tmp_path / "out", relight__path__height=0.3, relight__path__radius=0.2, **options)
    assert facts["shows"] == sweep and facts["view"] == 0 and facts["images"] == 5
    table = pd.read_csv(tmp_path / "out" / "sweep.csv")
    axes = table[["direction_x", "direction_y", "direction_z"]].to_numpy()
    places = table[["x", "y", "z"]].to_numpy()
    assert len(table) == 5 and np.ptp(axes, axis=0).max() > 0.5
    assert (np.ptp(places, axis=0).max() == 0.0) == (sweep == "aim")
    with Image.open(io.BytesIO((tmp_path / "out" / "sweep.webp").read_bytes())) as video:
        assert video.n_frames == frames
    with Image.open(tmp_path / "out" / "strip.png") as strip:
        assert strip.width == 4 * 32 + 3 * 4 and strip.height == 2 * 32 + 4


def test_places_and_cone_of_a_sweep_are_those_of_the_configuration(inputs, tmp_path: Path) -> None:
    options = {"relight__sweep": "aim", "relight__path__frames": 3, "relight__path__spot__cone_angle": 12.0}
    aims = [-0.3, 0.0, -0.5, 0.3, 0.0, -0.5]
    run(inputs, tmp_path / "out", relight__path__position=[0.0, -0.3, 0.4], relight__path__aims=aims, **options)
    table = pd.read_csv(tmp_path / "out" / "sweep.csv")
    assert table[["x", "y", "z"]].to_numpy().tolist() == [[0.0, -0.3, 0.4]] * 3
    first = np.array([-0.3, 0.3, -0.9]) / math.sqrt(0.09 + 0.09 + 0.81)
    np.testing.assert_allclose(table[["direction_x", "direction_y", "direction_z"]].to_numpy()[0], first, atol=1e-12)


def test_images_of_another_size_see_the_same(inputs, tmp_path: Path) -> None:
    write_lights(tmp_path / "one.json", RIGS["one"])
    lights = {"relight__lights": str(tmp_path / "one.json"), "relight__indices": [0]}
    run(inputs, tmp_path / "small", **lights)
    run(inputs, tmp_path / "large", relight__resolution=64, **lights)
    small, large = (read_image(tmp_path / name / "images/one/view_0.exr")[0] for name in ("small", "large"))
    assert small.shape == (32, 32, 3) and large.shape == (64, 64, 3)
    means = large.reshape(32, 2, 32, 2, 3).mean(axis=(1, 3))
    assert np.median(np.abs(means - small)) < 2e-3 * small.mean()  # measured 4e-4


def test_a_sweep_that_lights_nothing_in_sight_is_refused(inputs, tmp_path: Path) -> None:
    beyond = {"relight__path__position": [0.0, 0.0, 5.0], "relight__path__aims": [-1.0, 0.0, 9.0, 1.0, 0.0, 9.0]}
    with pytest.raises(InputError, match=r"relight\.path.*black frames"):
        run(inputs, tmp_path / "out", relight__sweep="aim", relight__path__frames=2, **beyond)


def test_a_sweep_that_is_black_for_a_while_says_so(inputs, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # From above a room whose walls cast no shadow: first away from it, then at its floor.
    way = {"relight__path__position": [0.0, 0.0, 5.0], "relight__path__aims": [-9.0, 0.0, 9.0, 0.5, 0.0, 0.0]}
    cone = {"relight__path__spot__cone_angle": 10.0, "effects__shadows": False}
    run(inputs, tmp_path, relight__sweep="aim", relight__path__frames=3, **way, **cone)
    assert "of 3 frames are black" in capsys.readouterr().out


def test_folders_of_other_programs_are_no_targets(tmp_path: Path) -> None:
    """Jupyter's .ipynb_checkpoints was taken for the first target, whose transforms.json was asked for."""
    (tmp_path / "targets/.ipynb_checkpoints").mkdir(parents=True)
    with pytest.raises(InputError, match="expected fit targets, for their cameras, found none"):
        target_folders(tmp_path)
    for name in ("frame_10", "frame_9"):
        (tmp_path / "targets" / name).mkdir()
    assert [path.name for path in target_folders(tmp_path)] == ["frame_9", "frame_10"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"relight__indices": [2]}, r"relight\.indices.*2 cameras"),
        ({"relight__indices": []}, r"relight\.indices"),
        ({"relight__sweep": "aim", "relight__path__aims": [0.0, 0.0, -0.5, 0.0, 0.0, -0.6]}, r"path\.aims"),
    ],
)
def test_cameras_and_ways_that_make_no_sense_are_refused(inputs, tmp_path: Path, changes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        run(inputs, tmp_path / "out", **changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"relight__sweep": "orbit", "relight__counts": [1, 2]}, "counts and sweep=orbit"),
        ({"relight__lights": "x.json", "relight__rigs": "targets"}, "lights and rigs=targets"),
        ({"relight__sweep": "aim", "relight__path__spot__falloff": 3.0}, r"relight\.path\.spot\.falloff"),
        ({"scene__kind": "ply", "scene__path": "x.ply"}, "a scene with images"),
        ({"relight__counts": [2], "fit__target": "here"}, r"fit\.target"),
        ({"relight__counts": [2], "relight__resolution": 64}, r"relight\.resolution"),
    ],
)
def test_configurations_that_make_no_sense_are_refused_before_anything_is_made(changes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        relight.STAGE.needs(configured(**changes))


def test_an_empty_light_file_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    write_lights(tmp_path / "none.json", ())
    with pytest.raises(InputError, match="at least one light"):
        relight.STAGE.files(configured(relight__lights=str(tmp_path / "none.json")))


def test_the_stage_needs_what_has_the_cameras_or_the_targets() -> None:
    def needs(**changes: object) -> list[Need]:
        return list(relight.STAGE.needs(configured(**changes)))[1:]

    assert needs() == [Need("generate_dataset")]
    assert needs(fit__targets="generated") == [Need("generate_targets")]
    assert needs(fit__targets="generated", relight__views="test") == [Need("generate_dataset")]
    assert needs(relight__lights="x.json", fit__target="here") == []
    counted = needs(relight__counts=[1, 8])
    assert [need.changes["targets.count"] for need in counted] == [[1, 1], [8, 8]]
    assert all(need.stage == "generate_targets" for need in counted)
    assert relight.STAGE.needs(configured(relight__counts=[1, 8]))[0] == Need("freeze")


def test_numbers_of_lights_are_compared_side_by_side(inputs, tmp_path: Path) -> None:
    made = inputs["generate_dataset"]
    context = StageContext(
        configured(relight__counts=[1, 2], relight__limit=1, relight__indices=[0]),
        inputs,
        {"generate_targets": [made]},
        tmp_path,
    )
    relight.run(context)
    table = pd.read_csv(tmp_path / "relight.csv")
    assert table["lights"].tolist() == [1, 2] and table["rig"].tolist()[1] == "2_lights_both"
