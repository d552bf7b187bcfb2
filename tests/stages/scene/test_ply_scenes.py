"""scene=ply: surfels from a file take the place of trained ones; stage=export writes such files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from clouds import cloud
from lit_room import VISIBLE, frozen_room, room_cameras, room_surfels
from ply_files import gaussian_columns, write_ply
from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.light_file import write_lights
from rgspipe.datasets.ply.file import save_ply
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews
from rgspipe.graph.pipeline import run
from rgspipe.graph.resolver import resolve
from rgspipe.renderer.ply import load_ply
from rgspipe.scene import PointLight
from rgspipe.stages import load_stage

LIGHT = PointLight(torch.tensor(VISIBLE, dtype=torch.float64), torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64))


def configured(root: Path, stage: str, *overrides: str) -> RgspipeConfig:
    small = ["freeze.gather_rays=64", "freeze.patches=150", "freeze.dictionary_grid=6"]
    return compose_config(
        [
            f"stage={stage}",
            "scene=ply",
            f"scene.path={root / 'room.ply'}",
            f"outputs={root / 'out'}",
            *small,
            *overrides,
        ]
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """room.ply, and a target of the room under one light."""
    root = tmp_path_factory.mktemp("ply_scene")
    save_ply(root / "room.ply", room_surfels().to(torch.float32))
    cameras = room_cameras(32)[:1]
    views = FitViews.prepare(frozen_room(), cameras, sharp=True)
    (root / "target").mkdir()
    write_image(root / "target" / "view_0.exr", views.render(LIGHT)[0].numpy())
    write_transforms(root / "target" / "transforms.json", [frame_entry("./view_0", cameras[0])])
    write_lights(root / "light.json", (LIGHT,))
    return root


def test_a_light_is_recovered_in_a_scene_from_a_file(folder: Path) -> None:
    target = [f"fit.target={folder / 'target'}", f"fit.truth={folder / 'light.json'}"]
    artifact = run(configured(folder, "evaluate", *target), load_stage)
    row = pd.read_csv(artifact.file("metrics.csv")).iloc[0]
    assert row["position_error"] < 0.002  # measured 1e-4: the frozen room of the target has 64 rays, too
    stages = {path.parent.name for path in (folder / "out" / "room").glob("*/latest")}
    assert stages == {"import_ply", "freeze", "fit_light", "evaluate"}
    conversion = json.loads((folder / "out/room/import_ply/latest/conversion.json").read_text())
    assert conversion["surfels"] == len(room_surfels()) and conversion["losses"] == []


def test_a_fit_by_the_papers_method_starts_on_a_sphere(folder: Path) -> None:
    wanted = [f"fit.target={folder / 'target'}", "fit=paper_adam", "fit.adam.init=sphere"]
    artifact = run(configured(folder, "fit_light", *wanted, "fit.adam.epochs=1", "fit.adam.steps=2"), load_stage)
    assert len(pd.read_csv(artifact.file("results.csv"))) == 1
    with pytest.raises(InputError, match=r"fit\.adam\.init=sphere"):
        resolve(configured(folder, "fit_light", *wanted[:2]), load_stage)


def test_an_exported_scene_comes_back(folder: Path) -> None:
    artifact = run(configured(folder, "export"), load_stage)
    assert json.loads(artifact.file("conversion.json").read_text())["path"] == "surfels.ply"
    again, _ = load_ply(artifact.file("surfels.ply"))
    surfels = room_surfels().to(torch.float32)
    assert all(torch.equal(tensor, getattr(again, name)) for name, tensor in surfels.tensors().items())


def test_colours_of_an_export_show_the_scene_under_a_light(folder: Path) -> None:
    lit = run(configured(folder, "export", f"export.light={folder / 'light.json'}"), load_stage)
    plain = run(configured(folder, "export"), load_stage)
    one, two = (write_table(artifact.file("surfels.ply")) for artifact in (lit, plain))
    assert np.ptp(two["f_dc_0"]) < 1e-5 < np.ptp(one["f_dc_0"]), "the room's albedo is of one colour"
    brightest = np.array([one[axis][one["f_dc_1"].argmax()] for axis in "xyz"])
    assert np.linalg.norm(brightest - np.array(VISIBLE)) < 0.35, "near the light"


def write_table(path: Path) -> np.ndarray:
    from plyfile import PlyData

    return PlyData.read(str(path))["vertex"].data


@pytest.mark.parametrize("stage", ["generate_dataset", "init_depth", "train_surfels", "report"])
def test_stages_that_need_images_are_refused_before_anything_is_made(folder: Path, stage: str) -> None:
    with pytest.raises(InputError, match=r"a scene with images.*scene=ply.*room\.ply.*stage=freeze"):
        resolve(configured(folder, stage), load_stage)


def test_a_fit_needs_images_of_its_own(folder: Path) -> None:
    with pytest.raises(InputError, match=r"fit\.target=DIR"):
        resolve(configured(folder, "fit_light"), load_stage)


@pytest.mark.parametrize(
    ("stage", "override", "words"),
    [("freeze", "freeze.surfels=truth", r"freeze\.surfels"), ("benchmark", "benchmark=renderer", "benchmark=fit")],
)
def test_what_a_file_does_not_have_is_not_measured(folder: Path, stage: str, override: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        resolve(configured(folder, stage, override), load_stage)


def test_a_scene_with_too_many_surfels_is_refused_with_what_it_would_take(folder: Path) -> None:
    count = len(room_surfels())
    with pytest.raises(InputError, match=rf"at most 100 surfels.*found {count}.*GiB.*scene\.ply\.crop"):
        run(configured(folder, "import_ply", "scene.ply.max_surfels=100"), load_stage)
    few = run(
        configured(folder, "import_ply", "scene.ply.max_surfels=100", "scene.ply.crop=[-1,-1,-1,0,0,-0.4]"), load_stage
    )
    assert len(load_surfels(few.file("surfels.safetensors"))) <= 100


def test_importing_another_scene_is_refused(tmp_path: Path) -> None:
    config = compose_config(["stage=import_ply", "scene=cornell", f"outputs={tmp_path}"])
    with pytest.raises(InputError, match="scene=ply"):
        run(config, load_stage)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["scene.ply.low=0.9", "scene.ply.high=0.5"], r"scene\.ply\.low"),
        (["scene.ply.crop=[0,0,0,1,1,0]"], r"scene\.ply\.crop"),
    ],
)
def test_settings_that_contradict_each_other_are_refused(folder: Path, overrides: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        run(configured(folder, "import_ply", *overrides), load_stage)


def test_settings_reach_the_surfels_and_change_the_fingerprint(tmp_path: Path) -> None:
    write_ply(tmp_path / "room.ply", gaussian_columns())
    plain, other = (
        configured(tmp_path, "import_ply", "scene.ply.fronts=outwards", *more)
        for more in ([], ["scene.ply.srgb=false", "scene.ply.high=0.95", "scene.ply.layer=3"])
    )
    assert resolve(plain, load_stage).key != resolve(other, load_stage).key
    one, two = (load_surfels(run(c, load_stage).file("surfels.safetensors")) for c in (plain, other))
    assert two.coverage.high == 0.95 and float(two.albedo[0, 0]) == 0.5
    assert two.coverage.layer_thickness == pytest.approx(3 * one.coverage.layer_thickness, rel=1e-6)


def test_a_changed_file_is_imported_again(tmp_path: Path) -> None:
    surfels = cloud(30, 0).to(torch.float32)
    save_ply(tmp_path / "room.ply", surfels)
    before = resolve(configured(tmp_path, "freeze"), load_stage).key
    save_ply(tmp_path / "room.ply", replace(surfels, albedo=0.5 * surfels.albedo))
    assert resolve(configured(tmp_path, "freeze"), load_stage).key != before
