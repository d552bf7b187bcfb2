"""What became of the lights in rooms that nobody tuned: a row a fit, and their figures against each property."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import pandas as pd

from rgspipe.evaluation.classes import ALL, class_order
from rgspipe.evaluation.metrics import RESAMPLES
from rgspipe.evaluation.tables import TARGET_COLUMNS
from rgspipe.scene.grade import Grade
from rgspipe.studies.lights import figures, silent

#: What a fit says that could not be made.
FAILED = "failed"

#: Columns that are true, false or not known, and numbers that a room may lack.
VERDICTS = ("success", "inside_95", "count_right", "types_right", "noise_allows")
MEASURED = ("lens", "unseen", "guessed", "surfels", "held_out_psnr", "training_seconds", "grade_error")

#: Ranges of properties: column, and the least value of each range but the first.
RANGES: Mapping[str, tuple[float, ...]] = {
    "train_views": (50, 75),
    "lens": (45.0, 60.0),
    "noise": (0.03, 0.06),
    "unseen": (0.05, 0.15, 0.3),
    "guessed": (0.05, 0.15, 0.3),
}

#: Properties that have names.
NAMED = ("occlusion", "plan", "tone", "fronts", "stand", "grade")

#: Rooms of their own interest: white ones with noise up to this, and the quarter with few views and narrow lenses.
LITTLE_NOISE, QUARTER = 0.03, 0.25
WHITE, SCARCE = "white, noise up to 3 %", "quarter with the fewest views and narrowest lenses"

#: A scene whose grade says good, but whose lights are off by more than this, has been graded wrongly.
MISLED = 0.03

#: What all fits together are called.
EVERYTHING = "all"


Row = Mapping[str, Any]


@dataclass(frozen=True)
class Group:
    """Fits that have something in common.

    Attributes:
        name: the property.
        value: what they have in common, as text.
        rows: the fits.
    """

    name: str
    value: str
    rows: pd.DataFrame


def fit_rows(room: Row, targets: pd.DataFrame) -> list[Row]:
    """The rows of a room whose lights were looked for.

    Args:
        room: its properties by column.
        targets: rows of `tables.target_table`.

    Returns:
        The properties, the columns of `targets`, and `silent`: converged, not solved, and the truth in no region.
    """
    told = targets.assign(silent=silent(targets))
    return [dict(room) | row | {"failed_in": None} for row in told.to_dict("records")]


def failed_rows(room: Row, classes: Sequence[str], method: str, views: int, stage: str, reason: str) -> list[Row]:
    """The rows of a room whose lights could not be looked for, one a class.

    They count as not solved, in errors and in shares, but where the room itself could not be made.

    Args:
        stage: what failed.
        reason: why, in words.
    """
    made = stage != "generate_dataset"
    row = dict(room) | dict.fromkeys(TARGET_COLUMNS, math.nan) | dict.fromkeys(VERDICTS)
    if made:
        row |= {"position_error": math.inf, "intensity_error": math.inf}
        row |= {"success": False, "count_right": False, "types_right": False}
    row |= {"target": "", "method": method, "views": views, "result": FAILED, "reason": reason, "lights_found": 0}
    return [row | {"occlusion": name, "silent": False, "failed_in": stage} for name in classes]


def fits_table(rows: Sequence[Row]) -> pd.DataFrame:
    """Rows of `fit_rows` and `failed_rows` as one table, its `scene` first."""
    table = pd.DataFrame(rows).astype(dict.fromkeys(VERDICTS, "boolean") | dict.fromkeys(MEASURED, float))
    table.insert(0, "scene", "zoo_" + table["seed"].astype(str))
    return table


def summary(table: pd.DataFrame, seed: int, resamples: int = RESAMPLES) -> pd.DataFrame:
    """The figures of all fits, and of each group of them.

    Args:
        table: see `fits_table`.
        seed, resamples: of the resampling behind intervals of medians.

    Returns:
        A row for each `part`, `case`, `method`, `property`, `value` and number of `views`, with the number of `rooms`
        and the columns of `lights.figures`.
    """
    rows = []
    for (part, case, method), chosen in table.groupby(["part", "case", "method"], sort=False):
        for group in groups(chosen):
            for views, fits in group.rows.groupby("views"):
                named = {"part": part, "case": case, "method": method, "property": group.name, "value": group.value}
                named |= {"views": int(views), "rooms": fits["seed"].nunique()}
                rows.append(named | figures(fits, seed, resamples))
    return pd.DataFrame(rows)


def groups(table: pd.DataFrame) -> Iterator[Group]:
    """All fits, then those of each value of each property; a property that none of them has is left out."""
    yield Group(EVERYTHING, ALL, table)
    for name in NAMED:
        values = table[name].dropna()
        for value in class_order(values) if name == "occlusion" else sorted(set(values)):
            yield Group(name, str(value), table[table[name] == value])
    for name, limits in RANGES.items():
        yield from _ranges(table, name, limits)
    white = table[(table["tone"] == "white") & (table["noise"] <= LITTLE_NOISE)]
    yield from (Group("rooms", name, rows) for name, rows in ((WHITE, white), (SCARCE, scarce(table))) if len(rows))


def _ranges(table: pd.DataFrame, name: str, limits: Sequence[float]) -> Iterator[Group]:
    edges = (-math.inf, *limits, math.inf)
    values = table[name].astype(float)
    for low, high in pairwise(edges):
        rows = table[(values >= low) & (values < high)]
        if len(rows):
            yield Group(name, range_text(name, low, high), rows)


def range_text(name: str, low: float, high: float) -> str:
    """ "below 50", "5 to 15 %", "30 % and more"."""
    factor, unit = (100, " %") if name in ("noise", "unseen", "guessed") else (1, "")
    if math.isinf(low):
        return f"below {factor * high:g}{unit}"
    return f"{factor * low:g}{unit} and more" if math.isinf(high) else f"{factor * low:g} to {factor * high:g}{unit}"


def misled(table: pd.DataFrame) -> pd.DataFrame:
    """Fits that are off by more than `MISLED` in scenes whose grade is good."""
    return table[(table["grade"] == Grade.GOOD) & (table["position_error"] > MISLED)]


def scarce(table: pd.DataFrame) -> pd.DataFrame:
    """Fits of the quarter of the rooms with the fewest views and narrowest lenses, both ranks counting alike."""
    rooms = table.drop_duplicates("seed").dropna(subset=["lens"])
    order = rooms.assign(rank=rooms["train_views"].rank() + rooms["lens"].rank()).sort_values(["rank", "seed"])
    return table[table["seed"].isin(order["seed"].head(int(QUARTER * len(order))))]
