"""`stage=view`: what it shows of what is made, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.cli import main
from rgspipe.cli.view_stage import _cases, _Made
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.demo import ROOM, TARGET
from rgspipe.stages import load_stage


def test_a_sweep_is_refused(capsys: pytest.CaptureFixture) -> None:
    assert main(["-m", "stage=view"]) == 2
    assert "one page shows one scene" in " ".join(capsys.readouterr().err.split())


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
