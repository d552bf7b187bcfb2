"""What usually comes after a sweep."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from frozen_store import artifact
from rgspipe.cli.leading import lead_on_sweep
from rgspipe.store.files import write_json, write_text


def _fit(ended: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        write_text(folder / "results.csv", "target\na\n")
        write_json(folder / "a" / "lights.json", {"result": ended, "findings": []})

    return make


def _job(root: Path, number: int, stage: str, *overrides: str, ended: str = "converged") -> tuple[Path, dict]:
    store = root / str(number)
    made = artifact(store, stage, _fit(ended))
    given = [f"stage={stage}", f"outputs={store}", *overrides]
    return root / str(number), {"state": "done", "stage": stage, "overrides": given, "result": str(made.path)}


def _led(capsys: pytest.CaptureFixture[str], overrides: list[str], jobs: list[tuple[Path, dict]]) -> str:
    lead_on_sweep(overrides, jobs, Path("sweep/table.csv"))
    return capsys.readouterr().out


def test_jobs_that_lead_to_one_stage_lead_to_a_sweep_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    jobs = [_job(tmp_path, seed, "fit_light", f"seed={seed}") for seed in (1, 2)]
    said = _led(capsys, ["stage=fit_light", "seed=1,2", "scene=a b"], jobs)
    assert said == ("Next, to compare them with the truth: python -m rgspipe -m stage=evaluate seed=1,2 'scene=a b'\n")


def test_what_jobs_measured_is_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    jobs = [_job(tmp_path, seed, "evaluate", f"seed={seed}") for seed in (1, 2)]
    assert (
        _led(capsys, ["stage=evaluate", "seed=1,2"], jobs) == "Next, compare what the jobs measured: sweep/table.csv\n"
    )


def test_fits_that_lead_to_different_things_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    jobs = [
        _job(tmp_path, k, "fit_light", "fit.target=here", ended=end) for k, end in enumerate(("converged", "ambiguous"))
    ]
    assert _led(capsys, ["stage=fit_light"], jobs) == "Next, compare what the jobs measured: sweep/table.csv\n"


def test_jobs_without_a_table_lead_where_the_last_one_does(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    jobs = [_job(tmp_path, seed, "report", f"seed={seed}") for seed in (1, 2)]
    last = Path(jobs[-1][1]["result"])
    said = _led(capsys, ["stage=report", "seed=1,2"], jobs)
    assert said == f"Next, of job 2, open in a browser: {last / 'report.html'}\n"


def test_results_of_elsewhere_lead_nowhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    jobs = [_job(tmp_path, seed, "report", f"seed={seed}") for seed in (1, 2)]
    for _, status in jobs:
        status["result"] = str(tmp_path / "gone" / "scene" / "report" / "bb")
    assert _led(capsys, ["stage=report"], jobs) == ""
