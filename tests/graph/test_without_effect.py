"""Whoever sets what changes nothing of the result is told so; whoever sets what counts, or says a default, is not."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import pytest

import toys
from rgspipe.cli import main
from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.config.core import describe
from rgspipe.graph.resolver import Resolver, StageLoader
from rgspipe.graph.variants import below
from rgspipe.graph.without_effect import OPERATION, without_effect
from rgspipe.stages import NAMES, load_stage


@pytest.fixture(scope="module")
def resolver() -> Resolver:
    return Resolver(load_stage)


def idle(overrides: Sequence[str], resolver: Resolver) -> list[str]:
    config = compose_config(overrides)
    return without_effect(resolver.resolve(config.stage, config, {}), overrides, resolver)


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (
            "stage=fit_light light.spot.cone_angle=30 light.led.exponent=3",
            "light.spot.cone_angle=30 light.led.exponent=3",
        ),
        ("stage=fit_light light=spot light.spot.cone_angle=30", ""),
        ("stage=fit_light light=auto light.spot.cone_angle=30 light.sphere.radius=0.1", "light.sphere.radius=0.1"),
        ("stage=evaluate occlusion=occluded views.count=1 light=point seed=3 outputs=elsewhere device=cpu", ""),
        ("stage=evaluate targets.number=3", "targets.number=3"),
        ("stage=evaluate targets.number=3 fit.targets=generated", ""),
        ("stage=evaluate fit.truth=truth.json views.count=2 views.indices=[0]", "fit.truth=truth.json views.count=2"),
        (
            "stage=fit_light light=spot fit.sh_degree=4 effects=all effects.tolerance=0.1",
            "fit.sh_degree=4 effects.tolerance=0.1",
        ),
        # A group of which every key is one that does not count.
        ("stage=freeze light=spot views.count=3 accuracy.name=draft", "light=spot views.count=3 accuracy.name=draft"),
        ("stage=freeze accuracy=draft", ""),
        (
            "stage=train_surfels scene.path=room lamps.count=2 viewer.port=9",
            "scene.path=room lamps.count=2 viewer.port=9",
        ),
        # The recipes have the key, but the stage asks for another value everywhere.
        ("stage=study experiment=light_views views.count=2", "views.count=2"),
        (
            "stage=relight relight.sweep=aim relight.path.radius=2 relight.count=2",
            "relight.path.radius=2 relight.count=2",
        ),
        ("stage=relight relight.sweep=orbit relight.path.radius=2", ""),
        ("stage=overview scene=room", "scene=room"),
        # The report prints every setting, and has numbers of views of its own.
        (
            "stage=report scene=room report.views=[1] views.count=3 light.spot.cone_angle=30 export.metres=2",
            "views.count=3 light.spot.cone_angle=30 export.metres=2",
        ),
        ("stage=report train.steps=3 evaluate.success=0.1 light.count=2 relight.seed=3", "relight.seed=3"),
        ("stage=export export.metres=2", "export.metres=2"),
        ("stage=freeze hydra.job.name=one launcher=basic", ""),
    ],
)
def test_overrides_without_effect_are_told(overrides: str, told: str, resolver: Resolver) -> None:
    assert idle(overrides.split(), resolver) == told.split()


def test_what_decides_about_a_folder_of_targets_is_not_that_of_the_dataset(tmp_path: Path, resolver: Resolver) -> None:
    overrides = [f"fit.target={tmp_path}", "occlusion=visible", "fit.limit=2", "fit.truth=lights.json"]
    config = compose_config(["stage=evaluate", *overrides])
    # The target itself is not there: what counts is asked of the stages' keys alone.
    keys = {key for name in ("fit_light", "evaluate") for key in load_stage(name).keys(config)}
    assert {"fit.target", "fit.truth"} <= keys and not {"occlusion", "fit.limit"} & keys


def test_every_key_counts_for_some_stage_or_is_of_operation() -> None:
    changes: list[dict[str, object]] = [{}, {"scene.kind": "ply"}, {"scene.kind": "zoo"}, {"fit.target": "folder"}]
    changes += [{"scene.kind": kind} for kind in ("corner", "hotdog", "room", "blend", "external")]
    changes += [{"light.type": kind} for kind in ("spot", "led", "sphere", "panel", "profile")]
    changes += [{"fit.method": "paper_adam"}, {"fit.spot_basis": "sh", "fit.suggest_view": True, "views.indices": [0]}]
    changes += [{"relight.sweep": "aim"}, {"relight.sweep": "orbit"}, {"relight.counts": [1]}]
    changes += [{"effects.solver": "monte_carlo"}, {"export.lights": ["json"]}, {"targets.kind": "drive"}]
    changes += [{"targets.kind": kind} for kind in ("mixed", "spheres", "panels", "leds")]
    configs = [with_changes(RgspipeConfig(), one) for one in changes]
    # The report prints all of them.
    counted = {key for one in configs for name in NAMES if name != "report" for key in load_stage(name).keys(one)}
    rest = {key for key, _, _ in describe(RgspipeConfig()) if not below(key, counted)}
    # By the files and inputs that they choose, by the folder of a scene, on the page, and by nothing.
    chosen = {"scene.path", "fit.targets", "targets.cameras", "targets.max_bounces", "targets.luminaires"}
    others = {*chosen, "targets.mounted", "scene.name", "report", "viewer", "accuracy.name"}
    assert {key for key in rest if not below(key, (*OPERATION, *others))} == set()
    assert not any(below(key, counted) for key in OPERATION)


@pytest.mark.parametrize(("multirun", "told"), [([], 1), (["-m"], 2)])
def test_a_run_and_each_job_of_a_sweep_says_so(
    multirun: list[str], told: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    load: StageLoader = toys.load
    views = "views.count=1,2" if multirun else "views.count=2"
    words = ["stage=grow", f"outputs={tmp_path}", "dataset.resolution=8", views, "occlusion=visible"]
    assert main([*multirun, *words, "launcher=basic"], load) == 0
    said = capfd.readouterr()
    assert (said.out + said.err).count("No effect on this stage, nor on what it needs: occlusion=visible\n") == told


def test_a_page_hears_more_than_the_stage_that_it_shows(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.INFO)
    assert main(["stage=view", "viewer.port=9", f"outputs={tmp_path}", "--dry-run"]) == 0
    assert "No effect" not in capsys.readouterr().out + caplog.text
