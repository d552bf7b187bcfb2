"""The one table of a sweep."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from rgspipe.cli.sweep_table import write_sweep_table


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
