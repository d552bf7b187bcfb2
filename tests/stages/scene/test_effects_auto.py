"""effects=auto through the stages: decisions stand in plan and artifact, and what is not called for is not done."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import torch

from lit_room import room_surfels
from rgspipe.benchmark.effect_scenes import EFFECT_SCENES, ball
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.renderer import direct, mutual_visibility, transport
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight, Surfels
from rgspipe.stages.base import StageContext
from rgspipe.stages.lights import fit_light
from rgspipe.stages.scene import freeze
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key

LIGHT = PointLight(torch.tensor([0.5, -0.9, 0.6]), torch.tensor([1.0, 2.0, 0.5]))


def made(root: Path, stage: str, make) -> Artifact:
    recipe = {"config": {}, "inputs": {}, "code": {}}
    return ArtifactStore(root).build(Key("scene", stage, "aa"), recipe, make)[0]


def configured(stage: str, changes: Mapping[str, object]) -> RgspipeConfig:
    quick = {"freeze.gather_rays": 32, "freeze.patches": 40, "freeze.dictionary_grid": 4, "fit.search.starts": 2}
    return with_changes(RgspipeConfig(stage=stage), {**quick, "effects.auto": True, **changes})


def freeze_scene(root: Path, surfels: Surfels) -> Artifact:
    trained = made(root, "train_surfels", lambda folder: save_surfels(folder / "surfels.safetensors", surfels) or {})

    def make(folder: Path) -> dict:
        context = StageContext(configured("freeze", {}), {"train_surfels": trained}, {}, folder)
        freeze.run(context)
        return context.facts

    return made(root, "freeze", make)


def write_target(folder: Path, scene: FrozenScene) -> None:
    """One image of the scene from the outside."""
    camera = EFFECT_SCENES["dark ball"].camera(24)
    folder.mkdir()
    write_image(folder / "view_0.exr", scene.render(scene.view(camera), (LIGHT,), sharp=False).numpy())
    write_transforms(folder / "transforms.json", [frame_entry("./view_0", camera)])


def write_known(folder: Path) -> dict:
    """The training lights, where the published method starts."""
    camera = EFFECT_SCENES["dark ball"].camera(24)
    write_transforms(folder / "transforms_train.json", [frame_entry("./train/r_0", camera, LIGHT)])
    return {}


def fit(frozen_scene: Artifact, root: Path, target: Path, **changes: object) -> tuple[pd.DataFrame, dict]:
    inputs = {"freeze": frozen_scene, "generate_dataset": made(root.parent / "store", "generate_dataset", write_known)}
    config = configured("fit_light", {"fit.target": str(target), **changes})
    root.mkdir()
    context = StageContext(config, inputs, {}, root)
    fit_light.run(context)
    return pd.read_csv(root / "results.csv"), context.facts


def allow_nothing_but_direct_light(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever casts a shadow ray or a gather ray, or lets light bounce, fails."""
    point_irradiance = direct.point_irradiance

    def unshadowed(bvh, positions, shadows, at):
        assert not shadows, "a shadow ray was cast"
        return point_irradiance(bvh, positions, shadows, at)

    def refuse(*arguments: object, **named: object) -> None:
        raise AssertionError("light bounced, or would have to")

    monkeypatch.setattr(direct, "point_irradiance", unshadowed)
    monkeypatch.setattr(mutual_visibility, "build_gather", refuse)
    monkeypatch.setattr(transport.PatchTransport, "gathered", refuse)
    # The cost of what is left out cannot be known without doing it.
    monkeypatch.setattr(freeze, "measure_costs", lambda scene: {})


@pytest.mark.parametrize("method", ["search_lm", "paper_adam"])
def test_a_convex_object_pays_for_no_shadow_ray_and_no_bounce(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the trained surfels to the fitted light, which is the one found with everything simulated."""
    surfels = ball(2600, 0.04)
    write_target(tmp_path / "target", FrozenScene.freeze(surfels, gather_rays=32, patches=40, seed=0))
    changes = {"fit.method": method, "fit.adam.epochs": 1, "fit.adam.steps": 3}
    paid = freeze_scene(tmp_path / "paid", surfels)
    table, _ = fit(paid, tmp_path / "all", tmp_path / "target", **changes, **{"effects.auto": False})
    allow_nothing_but_direct_light(monkeypatch)
    free = freeze_scene(tmp_path / "free", surfels)
    cheap, facts = fit(free, tmp_path / "auto", tmp_path / "target", **changes)
    assert [decision["simulated"] for decision in facts["effects"]["choice"]["decisions"]] == [False] * 4
    pd.testing.assert_frame_equal(table.drop(columns="seconds"), cheap.drop(columns="seconds"), rtol=1e-6)


def test_what_is_left_out_of_a_fit_stands_in_its_artifact_with_reason_bound_and_saving(tmp_path: Path) -> None:
    surfels = room_surfels()
    artifact = freeze_scene(tmp_path / "store", replace(surfels, albedo=1e-5 * surfels.albedo))
    write_target(tmp_path / "target", FrozenScene.load(artifact.folder()))
    _, facts = fit(artifact, tmp_path / "fit", tmp_path / "target")
    noted = json.loads(json.dumps(facts["effects"], allow_nan=False))
    shadows, bounces = noted["choice"]["decisions"][:2]
    assert shadows["simulated"] and not bounces["simulated"] and 0.0 < bounces["bound"] <= noted["tolerance"]
    assert "saves" in bounces["reason"] and "ms a step" in bounces["reason"]
    assert artifact.facts["effects"]["bounds"] == noted["bounds"]
    _, forced = fit(artifact, tmp_path / "forced", tmp_path / "target", **{"effects.auto": False})
    assert "effects" not in forced


def test_the_plan_says_what_is_decided_before_anything_is_made(tmp_path: Path) -> None:
    artifact = freeze_scene(tmp_path / "store", ball(2600, 0.04))
    config = configured("fit_light", {})
    assert fit_light.remarks(config, {}) == ["effects: decided after freeze"]
    reasons = fit_light.remarks(config, {"freeze": artifact})
    assert reasons[0].startswith("shadows left out: no surfel rises above the plane of another, saves")
    off = fit_light.remarks(configured("fit_light", {"effects.interreflection": False}), {"freeze": artifact})
    assert off[1] == "interreflection left out: as configured"
    assert fit_light.remarks(configured("fit_light", {"effects.auto": False}), {"freeze": artifact}) == ()
    write_target(tmp_path / "target", FrozenScene.load(artifact.folder()))
    folder = tmp_path / "target"

    def make(where: Path) -> dict:
        context = StageContext(configured("fit_light", {"fit.target": str(folder)}), {"freeze": artifact}, {}, where)
        fit_light.run(context)
        return context.facts

    fitted = made(tmp_path / "store", "fit_light", make)
    assert fit_light.remarks(config, {"fit_light": fitted}) == list(reasons)


def test_the_plan_never_says_that_there_are_no_spots_where_spots_may_be_found(tmp_path: Path) -> None:
    """Of unknown type, each light counts as the spot that it may be, which no bound is smaller for."""
    surfels = room_surfels()
    artifact = freeze_scene(tmp_path / "store", replace(surfels, albedo=1e-5 * surfels.albedo))

    def reasons(**light: object) -> list[str]:
        return list(fit_light.remarks(configured("fit_light", light), {"freeze": artifact}))

    assert reasons(**{"light.type": "point"})[2] == "spot cones left out: the rig has no spots"
    assert reasons(**{"light.type": "auto"}) == reasons(**{"light.type": "spot"})
    assert reasons(**{"light.type": "auto"})[2].startswith("spot cones simulated: no bound on what this changes, costs")
    harmonics = {"fit.spot_basis": "sh", "fit.sh_degree": 5}
    points = reasons(**{"light.type": "point"}, **harmonics)
    for kind in ("spot", "auto"):
        said = reasons(**{"light.type": kind}, **harmonics)
        assert said[2] == "spot cones simulated: in spherical harmonics up to degree 5, as configured"
        assert said[:2] + said[3:] == points[:2] + points[3:]
