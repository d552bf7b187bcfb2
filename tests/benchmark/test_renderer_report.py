"""A benchmark that was interrupted measures what is missing, or was damaged, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from rgspipe.benchmark.renderer_report import Bench, _load_path, _part


@pytest.mark.parametrize(
    ("damage", "measured"),
    [
        (lambda path: None, 1),
        (lambda path: path.write_bytes(b""), 2),
        (lambda path: path.write_text("time\n"), 2),
        (lambda path: _load_path(Bench((), 1, {}, path.parent), "rays").unlink(), 2),
    ],
    ids=["whole", "emptied", "cut off", "without the load"],
)
def test_a_part_is_measured_again_where_it_is_not_whole(
    tmp_path: Path, damage: Callable[[Path], object], measured: int
) -> None:
    bench, calls = Bench((), 1, {}, tmp_path), []

    def measure(given: Bench) -> pd.DataFrame:
        calls.append(given)
        return pd.DataFrame({"time": [1.0, 2.0]})

    _part(bench, "rays", measure)
    damage(tmp_path / "rays.csv")
    assert _part(bench, "rays", measure)["time"].tolist() == [1.0, 2.0] and len(calls) == measured
