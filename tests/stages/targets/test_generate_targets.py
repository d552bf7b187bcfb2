"""The stages of generated targets: what they ask for, what they refuse, and targets of a pool on disk."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from luminaire_files import ies
from rgspipe.blender.pool.job import SpotRange
from rgspipe.blender.pool.pool_file import PooledLight, write_pool
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.config.spoken import told_with_keys
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import open_dataset
from rgspipe.errors import InputError
from rgspipe.scene import PointLight, SpotLight
from rgspipe.stages.base import Need, StageContext
from rgspipe.stages.targets import generate_targets, render_olat
from tiny_dataset import HEIGHT, WIDTH, tiny_camera


def _config(**values: object) -> RgspipeConfig:
    changes = {key.replace("__", "."): value for key, value in values.items()}
    return with_changes(RgspipeConfig(stage="generate_targets"), changes)


def _pool(folder: Path, kind: str, number: int) -> SimpleNamespace:
    """An artifact: grey images, each brighter than the one before."""
    ones, down = torch.ones(3, dtype=torch.float64), torch.tensor([0.0, 0.0, -1.0], dtype=torch.float64)
    entries = []
    for index in range(number):
        place = torch.tensor([0.3 * index, 0.5 * (kind == "spots"), 0.0], dtype=torch.float64)
        spot = SpotLight(place, ones, down, "smoothstep", 0.4, 0.2)
        entries.append((f"light_{index}", "visible", PointLight(place, ones) if kind == "points" else spot))
        grey = torch.full((HEIGHT, WIDTH, 3), 1.0 + 0.1 * index)
        write_image(folder / f"light_{index}/view_0.exr", grey, torch.ones(HEIGHT, WIDTH))
    write_pool(folder, "tiny", entries, [tiny_camera()], [[-0.5] * 3, [0.5] * 3], 1.0, [0.0] * 3)
    return SimpleNamespace(folder=lambda: folder)


def _made(config: RgspipeConfig, tmp_path: Path, *pools: SimpleNamespace) -> StageContext:
    (tmp_path / "made").mkdir(parents=True)
    context = StageContext(config, {}, {"render_olat": pools}, tmp_path / "made")
    generate_targets.run(context)
    return context


def test_mixed_targets_take_a_pool_of_each_type(tmp_path: Path) -> None:
    config = _config(targets__kind="mixed", targets__number=5, targets__count=[2, 3], targets__weakest=0.01)
    assert generate_targets.STAGE.needs(config) == (
        Need("render_olat", {"targets.kind": "points"}),
        Need("render_olat", {"targets.kind": "spots"}),
    )
    context = _made(config, tmp_path, _pool(tmp_path / "p", "points", 3), _pool(tmp_path / "s", "spots", 4))
    assert context.facts == {"kind": "mixed", "targets": 5, "pool": 7}
    targets = open_dataset(context.folder, train=False, test=False).targets
    assert [target.name for target in targets] == [f"rig_{index:04d}" for index in range(5)]
    for target in targets:
        lights = read_lights(context.folder / "truth" / f"{target.name}.json")
        assert {type(light) for light in lights} == {PointLight, SpotLight}
        assert target.occlusion == "visible"


def test_lights_that_are_alone_are_not_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(light: PooledLight) -> None:
        raise AssertionError("an image was read to measure its light")

    monkeypatch.setattr(PooledLight, "brightness", refuse)
    context = _made(_config(targets__number=3), tmp_path, _pool(tmp_path / "p", "points", 2))
    truths = [read_json(context.folder / f"truth/rig_000{index}.json", "a truth") for index in range(3)]
    assert [[light["share"] for light in truth["lights"]] for truth in truths] == [[1.0]] * 3
    with pytest.raises(AssertionError, match="was read"):
        _made(_config(targets__count=[1, 2]), tmp_path / "two", _pool(tmp_path / "q", "points", 2))


def test_a_track_pairs_its_lights(tmp_path: Path) -> None:
    config = _config(targets__kind="drive", scene__kind="corner")
    context = _made(config, tmp_path, _pool(tmp_path / "t", "spots", 6))
    assert context.facts["targets"] == 3
    lights = read_lights(context.folder / "truth/rig_0001.json")
    assert [round(light.position[0].item(), 6) for light in lights] == [0.6, 0.9]


#: Two cameras: where each stands, what it looks at, degrees across.
CAMERAS = [0.1, 0.2, 0.3, 0.5, 0.2, 0.3, 60.0, 0.0, 0.0, 1.0, 0.0, 0.3, 0.0, 90.0]


def test_cameras_and_bounces_of_a_pool_may_differ_from_the_dataset_s() -> None:
    own, given = _config(), _config(targets__cameras=CAMERAS, targets__views=2, targets__max_bounces=64)
    assert render_olat.pool_job(own).cameras == ()
    assert render_olat.pool_job(own).dataset.max_bounces == own.dataset.max_bounces
    job = render_olat.pool_job(given)
    assert [(view.origin, view.focus, view.degrees) for view in job.cameras] == [
        ((0.1, 0.2, 0.3), (0.5, 0.2, 0.3), 60.0),
        ((0.0, 0.0, 1.0), (0.0, 0.3, 0.0), 90.0),
    ]
    assert job.dataset.max_bounces == 64
    assert {"targets.cameras", "targets.max_bounces"} <= set(render_olat.STAGE.keys(given))
    assert not {"targets.cameras", "targets.max_bounces"} & set(render_olat.STAGE.keys(own))


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"targets__cameras": CAMERAS[:-1], "targets__views": 1}, "13 numbers"),
        ({"targets__cameras": CAMERAS, "targets__views": 3}, "14 numbers"),
        ({"targets__cameras": [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 60.0], "targets__views": 1}, r"0,0,1,0,0,1,60"),
        ({"targets__cameras": [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 180.0], "targets__views": 1}, r"0,0,0,180"),
    ],
)
def test_cameras_that_are_none_are_refused(changes: dict, found: str) -> None:
    with pytest.raises(InputError, match=found):
        render_olat.STAGE.needs(_config(**changes))


def test_targets_of_another_number_need_no_other_pool() -> None:
    few, many = _config(targets__number=3), _config(targets__number=9, targets__count=[1, 3], targets__seed=7)
    assert _values(render_olat.STAGE, few) == _values(render_olat.STAGE, many)
    assert _values(generate_targets.STAGE, few) != _values(generate_targets.STAGE, many)
    spots = _config(targets__kind="spots", targets__spot__cone_angle=[20.0, 30.0])
    assert "targets.spot" in render_olat.STAGE.keys(spots) and "targets.spot" not in render_olat.STAGE.keys(few)


def test_luminaires_of_a_folder_are_named_by_their_content(tmp_path: Path) -> None:
    for name in ("b.ies", "a.ies"):
        (tmp_path / name).write_text(ies())
    config = _config(targets__kind="profiles", targets__luminaires=str(tmp_path))
    files = [tmp_path.resolve() / name for name in ("a.ies", "b.ies")]
    assert render_olat.pool_job(config).lamps.luminaires == tuple(map(str, files))
    assert list(render_olat.STAGE.files(config)) == files and not render_olat.STAGE.files(_config())


def _values(stage, config: RgspipeConfig) -> list:
    section = config.targets
    return [getattr(section, key.split(".")[1]) for key in stage.keys(config) if key.startswith("targets.")]


def test_a_pool_is_like_the_dataset_s_targets_unless_told_otherwise() -> None:
    config = _config(dataset__resolution=64, dataset__samples=9, dataset__seed=5, dataset__train_views=7)
    job = render_olat.pool_job(config)
    assert (job.dataset.resolution, job.dataset.samples, job.views) == (64, 9, 3)
    assert (job.dataset.train_views, job.dataset.seed, job.number) == (0, 0, 60)
    own = render_olat.pool_job(_config(targets__resolution=32, targets__samples=4, targets__views=1, targets__pool=8))
    assert (own.dataset.resolution, own.dataset.samples, own.views, own.number) == (32, 4, 1, 8)


def test_angles_are_given_in_degrees_and_blends_as_they_are() -> None:
    spot = _config(targets__spot__cone_angle=[20.0, 30.0], targets__spot__falloff=[0.1, 0.3]).targets.spot
    assert render_olat.spot_range(spot) == SpotRange("smoothstep", (math.radians(20), math.radians(30)), (0.1, 0.3))
    gaussian = replace(spot, profile="gaussian", falloff=[2.0, 5.0])
    assert render_olat.spot_range(gaussian).falloff == pytest.approx((math.radians(2), math.radians(5)))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"scene__kind": "external"}, r"scene: .*Blender.*scene=external.*fit\.target=DIR"),
        ({"scene__kind": "ply"}, r"scene: .*scene=ply"),
        ({"targets__kind": "drive"}, r"targets\.kind.*scene=corner.*scene=cornell"),
        ({"targets__count": [3, 2]}, r"targets\.count.*3 to 2"),
        ({"targets__count": [1, 4], "targets__pool": 3}, r"targets\.count.*at most the 3 lights"),
        ({"targets__count": [4, 4], "targets__weakest": 0.3}, r"targets\.weakest.*below 0\.25"),
        ({"targets__kind": "profiles", "stage": "render_olat"}, r"targets\.luminaires.*null.*\.ies"),
        (
            {"targets__kind": "profiles", "targets__luminaires": "none.ies", "stage": "render_olat"},
            r"none\.ies.*luminaire",
        ),
        ({"targets__kind": "mixed", "stage": "render_olat"}, r"targets\.kind.*mixed.*stage=generate_targets"),
    ],
)
def test_what_can_not_be_made_is_refused_before_anything_is_made(values: dict, words: str) -> None:
    config = _config(**values)
    stage = render_olat.STAGE if config.stage == "render_olat" else generate_targets.STAGE
    with pytest.raises(InputError, match=words), told_with_keys():
        stage.needs(config)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"cone_angle": [30.0, 20.0]}, r"targets\.spot\.cone_angle.*\[30,20\].*order"),
        ({"falloff": [0.3, 0.2]}, r"targets\.spot\.falloff.*\[0\.3,0\.2\]"),
        ({"falloff": [0.3, 1.5]}, r"targets\.spot\.falloff.*at most 1 for smoothstep.*1\.5"),
        ({"profile": "linear", "falloff": [10.0, 25.0]}, r"targets\.spot\.falloff.*below 25 for linear"),
    ],
)
def test_spots_that_are_none_are_refused(values: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        spot = {f"targets__spot__{key}": value for key, value in values.items()}
        render_olat.pool_job(_config(targets__kind="spots", **spot))
