"""`stage=view`: what it shows of what is made, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from frozen_store import artifact
from rgspipe.cli import main
from rgspipe.cli.view_stage import _captured, _cases, _Made
from rgspipe.datasets.covariance_file import covariance_fields
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.demo import ROOM, TARGET
from rgspipe.stages import load_stage
from rgspipe.store.files import write_json


def test_a_sweep_is_refused(capsys: pytest.CaptureFixture) -> None:
    assert main(["-m", "stage=view"]) == 2
    assert "one page shows one scene" in capsys.readouterr().err


def test_a_target_of_ones_own_is_shown_with_its_truth(tmp_path: Path) -> None:
    truth = ROOM / "truth" / "hidden.json"
    made = _Made([f"outputs={tmp_path}", f"fit.target={TARGET}", f"fit.truth={truth}"], load_stage)
    assert made.find("generate_dataset") is None and made.find("fit_light") is None
    [case] = _cases(made, made.config("freeze"))
    assert case.name == "hidden" and len(case.photographs) == 3 and case.found is None
    assert case.truth == read_lights(truth)


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


def test_lamps_that_a_capture_found_are_shown_with_what_it_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lights = read_lights(ROOM / "truth" / "hidden.json")
    spread = {"lights": covariance_fields(1, {"covariance": [1e-4 * torch.eye(3)]})}

    def make(folder: Path) -> None:
        write_lights(folder / "lamps.json", lights, spread)
        write_json(folder / "metrics.json", {"words": "1 lamp was on."})

    capture = artifact(tmp_path, "capture_surfels", make)
    unknown, known = (
        _Made([f"outputs={tmp_path}", f"scene.lamps={word}"], load_stage) for word in ("unknown", "known")
    )
    for made in (unknown, known):
        monkeypatch.setattr(made, "find", lambda stage: capture if stage == "capture_surfels" else None)
    assert _captured(known) == []
    [case] = _captured(unknown)
    assert case.found.lights == lights and case.found.told == "1 lamp was on." and len(case.found.covariance) == 1
