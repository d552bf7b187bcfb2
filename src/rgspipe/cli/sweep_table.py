"""The results of a sweep in one table: table.csv, a row for each row of the jobs' own tables."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rgspipe.store.files import write_text

TABLE = "table.csv"

#: The table of each stage that has one row for what was measured or recovered.
STAGE_TABLES = {
    "fit_light": "results.csv",
    "evaluate": "metrics.csv",
    "judge": "quality.csv",
    "study": "study.csv",
    "benchmark": "benchmark.csv",
}


def write_sweep_table(folder: Path, jobs: Sequence[tuple[Path, Mapping[str, Any]]]) -> Path:
    """Write table.csv of a sweep.

    Columns: `job` (its folder's name), `state`, one for each override in which the jobs differ, and those of the
    jobs' own tables. A job without a result or a table that can be read has one row without these.

    Args:
        folder: the sweep's.
        jobs: folder and status of each job.
    """
    differing = _differing([_settings(status) for _, status in jobs])
    rows: list[dict[str, str]] = []
    for path, status in jobs:
        settings = _settings(status)
        own = {"job": path.name, "state": status["state"], **{key: settings.get(key, "") for key in differing}}
        rows += [{**own, **row} for row in _result_rows(status)]
    columns = list(dict.fromkeys(["job", "state", *differing, *(name for row in rows for name in row)]))
    stream = io.StringIO(newline="")
    writer = csv.DictWriter(stream, columns)
    writer.writeheader()
    writer.writerows(rows)
    write_text(folder / TABLE, stream.getvalue())
    return folder / TABLE


def _settings(status: Mapping[str, Any]) -> dict[str, str]:
    pairs = (text.partition("=") for text in status["overrides"])
    return {key.lstrip("+"): value.strip("'\"") for key, _, value in pairs}


def _differing(settings: Sequence[Mapping[str, str]]) -> list[str]:
    keys = dict.fromkeys(key for one in settings for key in one)
    return [key for key in keys if len({one.get(key) for one in settings}) > 1]


def _result_rows(status: Mapping[str, Any]) -> list[dict[str, str]]:
    name = STAGE_TABLES.get(status["stage"])
    if status["state"] != "done" or name is None:
        return [{}]
    path = Path(status["result"]) / name
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        print(f"The table has no results of this job: {path} cannot be read ({error})", file=sys.stderr)
        return [{}]
    return [{key: text for key, text in row.items() if key is not None} for row in rows]
