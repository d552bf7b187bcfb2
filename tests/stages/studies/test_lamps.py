"""The study of captures under unknown lamps: what it asks for, and what it makes of captures that are there or not."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.stages.base import Failure, StageContext
from rgspipe.stages.studies import study

CASES = 'study.cases=["1 lamp: dataset.lamps=1","8 bits: dataset.lamps=2 capture.white=0.99"]'

METRICS = {
    "truth": {
        "lamps": 2,
        "position_error": [0.004, 0.02],
        "stated": [0.008, 0.009],
        "intensity_ratio": [0.9, 1.02],
        "inside_95": [True, False],
        "in_sight": [True, False],
        "missed_in_sight": [],
    },
    "lamps": {"number": 2},
    "albedo": {"relative_l1": 0.03},
    "test_psnr_mean": 34.0,
}


def _config(*overrides: str) -> RgspipeConfig:
    return compose_config(["stage=study", "experiment=lamps", CASES, "study.lightings=2", *overrides])


def test_each_lighting_is_a_capture_and_later_lamps_are_asked_for() -> None:
    needs = study.STAGE.needs(_config())
    assert [need.stage for need in needs] == ["capture_surfels"] * 4 and all(need.may_fail for need in needs)
    assert [need.changes["dataset.seed"] for need in needs] == [0, 1, 0, 1]
    assert needs[2].changes["capture.white"] == 0.99 and needs[0].changes["scene.lamps"] == "unknown"
    later = study.STAGE.needs(_config("study.limit=1"))
    assert [need.stage for need in later[4:]] == ["evaluate"] * 4 and later[4].changes["fit.limit"] == 1
    for need in later:
        with_changes(_config(), need.changes)


def test_lamps_become_rows_and_medians(tmp_path: Path) -> None:
    (tmp_path / "metrics.json").write_text(json.dumps(METRICS))
    (tmp_path / "metrics.csv").write_text(
        "occlusion,position_error,intensity_error,position_sd,inside_95\nvisible,0.003,0.01,0.004,True\n"
    )
    artifact = SimpleNamespace(file=lambda name: tmp_path / name)
    failures = {"capture_surfels": {3: Failure("capture_surfels", "black")}}
    lists = {"capture_surfels": [artifact] * 3, "evaluate": [artifact] * 4}
    (tmp_path / "out").mkdir()
    context = StageContext(_config("study.limit=1"), {}, lists, tmp_path / "out", failures=failures)
    study.run(context)
    table = pd.read_csv(tmp_path / "out/study.csv")
    assert len(table) == 3 * 3 + 1 and context.facts["failed"] == 1
    assert table["where"].value_counts().to_dict() == {"in sight": 3, "of none": 3, "later, visible": 3, "refused": 1}
    figures = pd.read_csv(tmp_path / "out/summary.csv").set_index(["case", "where"])
    row = figures.loc[("1 lamp", "of none")]
    assert row["position_error"] == 0.02 and row["inside_95"] == 0.0 and row["right"] == 1.0 and row["count"] == 2
    assert figures.loc[("8 bits", "later, visible"), "intensity_error"] == pytest.approx(0.01)
    refused = figures.loc[("8 bits", "refused")]
    assert refused["failed"] == 1 and refused["count"] == 0 and pd.isna(refused["position_error"])
    # Of two captures one was refused, so that one number is right of two.
    assert figures.loc[("8 bits", "in sight"), "right"] == 0.5
    assert "| 2.00% |" in (tmp_path / "out/study.md").read_text()
    assert (tmp_path / "out/study.png").stat().st_size > 1000


def test_what_was_missed_or_refused_counts(tmp_path: Path) -> None:
    """One lamp of two was found, in half of the captures; fits of later lamps could not be made."""
    found = {name: values[:1] for name, values in METRICS["truth"].items() if name != "lamps"}
    truth = found | {"lamps": 2, "missed_in_sight": [True]}
    (tmp_path / "metrics.json").write_text(json.dumps(METRICS | {"truth": truth, "lamps": {"number": 1}}))
    artifact = SimpleNamespace(file=lambda name: tmp_path / name)
    lost = {"evaluate": dict.fromkeys(range(4), Failure("fit_light", "no light"))}
    (tmp_path / "out").mkdir()
    context = StageContext(
        _config("study.limit=1"), {}, {"capture_surfels": [artifact] * 4}, tmp_path / "out", failures=lost
    )
    study.run(context)
    figures = pd.read_csv(tmp_path / "out/summary.csv").set_index(["case", "where"])
    row = figures.loc[("1 lamp", "in sight")]
    assert row["count"] == 4 and row["worst"] == math.inf and row["right"] == 0.0
    assert figures.loc[("1 lamp", "later"), "failed"] == 2
    assert "| ∞ |" in (tmp_path / "out/study.md").read_text()
