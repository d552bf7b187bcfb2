"""The one table of a sweep."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from rgspipe.cli.sweep_table import write_sweep_table
from rgspipe.store.status import read_statuses


def _job(folder: Path, number: int, state: str, *overrides: str, stage: str = "fit_light") -> tuple[Path, dict]:
    status = {"state": state, "stage": stage, "overrides": [f"stage={stage}", "seed=3", *overrides]}
    if state == "done":
        result = folder / f"result_{number}"
        result.mkdir()
        (result / "results.csv").write_text('target,x,reason\na,0.5,"so, it is"\nb,0.25,\n')
        status["result"] = str(result)
    return folder / str(number), status


def test_rows_of_all_jobs_with_what_they_differ_in(tmp_path: Path) -> None:
    jobs = [
        _job(tmp_path, 0, "done", "views.count=1", "fit=search_lm"),
        _job(tmp_path, 1, "killed", "views.count=2", "fit=search_lm"),
        _job(tmp_path, 2, "done", "views.count=2", "fit=paper_adam"),
    ]
    table = pd.read_csv(write_sweep_table(tmp_path, jobs))
    assert table.columns.tolist() == ["job", "state", "views.count", "fit", "target", "x", "reason"]
    assert table["job"].tolist() == [0, 0, 1, 2, 2]
    assert table["state"].tolist() == ["done", "done", "killed", "done", "done"]
    assert table["fit"].tolist() == ["search_lm"] * 3 + ["paper_adam"] * 2
    assert table["x"].isna().tolist() == [False, False, True, False, False]
    assert table.loc[0, "reason"] == "so, it is"


def test_a_column_of_the_result_wins_over_an_override_of_its_name(tmp_path: Path) -> None:
    jobs = [_job(tmp_path, 0, "done", "target=all"), _job(tmp_path, 1, "failed", "target=none")]
    assert pd.read_csv(write_sweep_table(tmp_path, jobs))["target"].tolist() == ["a", "b", "none"]


def test_a_stage_without_a_table_has_a_row_a_job(tmp_path: Path) -> None:
    jobs = [_job(tmp_path, k, "done", f"seed={k}", stage="freeze") for k in range(2)]
    table = pd.read_csv(write_sweep_table(tmp_path, jobs))
    assert table.columns.tolist() == ["job", "state", "seed"] and table["seed"].tolist() == [0, 1]


@pytest.mark.parametrize(
    "damage",
    [
        Path.unlink,
        lambda path: path.write_bytes(b"\xff\xfe\x00"),
        lambda path: path.write_bytes(b""),
        lambda path: path.write_text('target,x\na,"never closed\n' + "b" * 200_000),
    ],
    ids=["gone", "no text", "emptied", "cut off"],
)
def test_a_damaged_table_of_one_job_breaks_that_of_no_other(tmp_path: Path, damage: Callable[[Path], object]) -> None:
    jobs = [_job(tmp_path, number, "done", f"seed={number}") for number in range(2)]
    damage(tmp_path / "result_0" / "results.csv")
    table = pd.read_csv(write_sweep_table(tmp_path, jobs))
    assert table.loc[table["job"] == 1, "target"].tolist() == ["a", "b"]


def test_a_longer_row_is_cut(tmp_path: Path) -> None:
    jobs = [_job(tmp_path, 0, "done")]
    (tmp_path / "result_0" / "results.csv").write_text("target,x\na,1,2,3\n")
    assert pd.read_csv(write_sweep_table(tmp_path, jobs))["x"].tolist() == [1]


def test_a_job_whose_status_is_damaged_has_a_row(tmp_path: Path) -> None:
    """As a sweep reads it, among others."""
    for number in range(2):
        (tmp_path / f"{number}").mkdir()
        status = _job(tmp_path, number, "done", f"seed={number}")[1]
        (tmp_path / f"{number}" / "status.json").write_text(json.dumps(status))
    (tmp_path / "0" / "status.json").write_text('{"state": "done", "stage": "fit_light", "overrides": 7}')
    table = pd.read_csv(write_sweep_table(tmp_path, read_statuses(tmp_path)))
    assert table["state"].tolist() == ["damaged", "done", "done"]
