"""`stage=view`: what it shows of what is made, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from rgspipe.cli import main
from rgspipe.cli.view_stage import _cases, _Made
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.demo import ROOM, TARGET
from rgspipe.stages import load_stage
from rgspipe.stages.lights.capture import captured_views
from rgspipe.stages.lights.targets import used_views


def test_a_sweep_is_refused(capsys: pytest.CaptureFixture) -> None:
    assert main(["-m", "stage=view"]) == 2
    assert "one page shows one scene" in " ".join(capsys.readouterr().err.split())


def test_a_target_of_ones_own_is_shown_with_its_truth(tmp_path: Path) -> None:
    truth = ROOM / "truth" / "hidden.json"
    made = _Made([f"outputs={tmp_path}", f"fit.target={TARGET}", f"fit.truth={truth}", "views.count=3"], load_stage)
    assert made.find("generate_dataset") is None and made.find("fit_light") is None
    [case] = _cases(made, made.config("freeze"))
    assert case.name == "hidden" and len(case.photographs) == 3 and case.found is None
    assert case.truth == read_lights(truth)


def test_it_is_shown_as_the_fit_takes_it(tmp_path: Path) -> None:
    settings = ["views.indices=[2,0]", "target_capture.noise=0.1", "target_capture.white=0.5", "fit.exposure=free"]
    made = _Made([f"outputs={tmp_path}", f"fit.target={TARGET}", *settings], load_stage)
    config = made.config("freeze")
    [case] = _cases(made, config)
    views, capture = captured_views(used_views(load_target(TARGET), config), "hidden", config)
    assert len(case.photographs) == 2
    for one, view in zip(case.photographs, views, strict=True):
        assert torch.equal(one.image, view.image) and torch.equal(one.mask, view.alpha)
        assert (one.clip, one.saturated) == (capture.clip, capture.saturated)
    clipped = _Made([f"outputs={tmp_path}", f"fit.target={TARGET}", "fit.clip=0.4"], load_stage)
    [case] = _cases(clipped, clipped.config("freeze"))
    assert [one.clip for one in case.photographs] == pytest.approx([0.4])


def test_why_a_fit_cannot_take_it_is_told(tmp_path: Path) -> None:
    made = _Made([f"outputs={tmp_path}", f"fit.target={TARGET}", "views.count=7"], load_stage)
    [case] = _cases(made, made.config("freeze"))
    assert not case.photographs and "Ask for fewer views" in case.lacking


def test_a_fit_of_it_is_shown_where_there_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = _Made([f"outputs={tmp_path}", f"fit.target={TARGET}"], load_stage)
    lights = read_lights(ROOM / "truth" / "hidden.json")
    (tmp_path / TARGET.name).mkdir()
    write_lights(
        tmp_path / TARGET.name / "lights.json", lights, {"result": "converged", "reason": "So it is.", "seconds": 1.0}
    )

    class Fits:
        path = tmp_path

    monkeypatch.setattr(made, "find", lambda stage: Fits() if stage == "fit_light" else None)
    [case] = _cases(made, made.config("freeze"))
    assert case.found is not None and case.found.lights == lights and case.found.told.endswith("\nSo it is.")
