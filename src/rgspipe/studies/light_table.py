"""The table of a study of recovered lights as people read it: values with their intervals, as text."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pandas as pd

from rgspipe.evaluation.classes import ALL
from rgspipe.evaluation.markdown import markdown_lines
from rgspipe.evaluation.plots import LABELS
from rgspipe.evaluation.shapes import told_shape_error
from rgspipe.percent import percent
from rgspipe.studies.lights import STATUSES, several, without_repeats

Row = dict[str, Any]

#: Of all kinds whose rows are kinds of lights.
LIGHTS_NOTE = (
    "Medians with 95 % bootstrap intervals, shares with Wilson’s; position errors are parts of the scene’s longest "
    "side, of several lights the worst. Errors of shapes are in degrees, of exponents, or of radii and sides in scene "
    "units. Silent: the fit says converged, is off by more than the limit, and no region that it states holds the "
    "truth. Times are wall times of single fits, beside whatever else ran."
)

#: What stands over the rows and says what the columns mean, by kind of study.
NOTES = {
    "views": "Medians with 95 % bootstrap intervals, shares with Wilson’s; position errors are parts of the scene’s "
    "longest side. Stated: the root mean square position error that fits expect of themselves (median over targets). "
    "Predicted: the same for the target’s first views, as the fits with the fewest views foretell it by their Fisher "
    "information. Times are wall times of single fits, beside whatever else ran.",
    "robustness": "Medians with 95 % bootstrap intervals, shares with Wilson’s; all classes together. Silent: the fit "
    "says converged, is off by more than the limit, and no region that it states holds the truth. With a wrong number "
    "of lights no target counts as solved; position errors are then those of the lights that have a match.",
    "kinds": LIGHTS_NOTE,
    "regions": LIGHTS_NOTE,
    "adam": LIGHTS_NOTE,
    "classes": "Medians with 95 % bootstrap intervals, shares with Wilson’s; position errors are parts of the scene’s "
    "longest side. True surfels are made from the true surfaces and albedo.",
}


#: Kinds whose rows are kinds of lights …
OF_LIGHTS = ("kinds", "regions", "adam")

#: … and those whose rows are any cases, with all classes of lights together.
TOGETHER = ("robustness", *OF_LIGHTS)


def shown_rows(table: pd.DataFrame, kind: str) -> tuple[list[str], list[Row]]:
    """Headings, and for each row its cells by heading as text.

    Args:
        table: rows of `lights.case_rows`; of views also with `predicted`.
        kind: one of `lights.KINDS`; those of `TOGETHER` show all classes together, the others each, and all of
            them together where there are several.
    """
    rows = table[table["occlusion"] == ALL] if kind in TOGETHER else without_repeats(table)
    columns = _columns(rows, kind)
    return list(columns), [{name: cell(row) for name, cell in columns.items()} for row in rows.to_dict("records")]


def markdown(table: pd.DataFrame, kind: str) -> str:
    """The same as a Markdown table."""
    headings, rows = shown_rows(table, kind)
    return markdown_lines(headings, [list(row.values()) for row in rows])


def _columns(rows: pd.DataFrame, kind: str) -> dict[str, Callable[[Row], str]]:
    columns: dict[str, Callable[[Row], str]] = {}
    alike = ["case"] if kind in TOGETHER else []
    for name in several(rows, ["scene", "case", "method"]) or alike:
        columns[name] = lambda row, name=name: str(row[name])
    columns["views"] = lambda row: str(row["views"])
    if kind not in TOGETHER:
        columns["light"] = _class
    columns["targets"] = lambda row: str(row["count"])
    columns["position error"] = lambda row: with_interval(row, "position", 2)
    columns["intensity error"] = lambda row: with_interval(row, "intensity", 1)
    if kind in OF_LIGHTS:
        columns["axis"] = lambda row: _degrees(row, "axis")
        # Studies that were made before kinds were told and types compared do not have these.
        if "shape_kind" in rows:
            columns["shape"] = _shape
        columns["right number"] = lambda row: with_interval(row, "right_number", 0)
        if "right_types" in rows:
            columns["right types"] = lambda row: with_interval(row, "right_types", 0)
    columns["solved"] = lambda row: with_interval(row, "success", 0)
    columns["s a fit"] = lambda row: "—" if math.isnan(row["seconds"]) else f"{row['seconds']:.2f}"
    if kind == "views":
        columns["stated"] = lambda row: percent(row["stated"])
        columns["predicted"] = lambda row: percent(row.get("predicted", math.nan))
    inside = with_interval if kind == "regions" else lambda row, name, digits: percent(row[name], digits)
    columns["truth in 95 % region"] = lambda row: inside(row, "inside_95", 0)
    if kind in TOGETHER:
        columns["silent"] = lambda row: with_interval(row, "silent", 0)
        columns["says"] = _statuses
    return columns


def _degrees(row: Row, name: str) -> str:
    return "—" if math.isnan(row[name]) else f"{row[name]:.2f}° ({row[f'{name}_low']:.2f}–{row[f'{name}_high']:.2f})"


def _shape(row: Row) -> str:
    if math.isnan(row["shape"]):
        return "—"
    middle, low, high = (told_shape_error(row[f"shape{end}"], row["shape_kind"]) for end in ("", "_low", "_high"))
    return f"{middle} ({low.removesuffix('°')}–{high.removesuffix('°')})"


def _class(row: Row) -> str:
    name = str(row["occlusion"])
    return "all classes" if name == ALL else LABELS.get(name, name)


def with_interval(row: Row, name: str, digits: int) -> str:
    """ "0.31 % (0.22–0.45)"."""
    low, high = row[f"{name}_low"], row[f"{name}_high"]
    middle = percent(row[name], digits)
    if math.isnan(low) or math.isnan(row[name]):
        return middle
    return f"{middle} ({percent(low, digits).removesuffix(' %')}–{percent(high, digits).removesuffix(' %')})"


def _statuses(row: Row) -> str:
    """What fits said of themselves, the most frequent first."""
    shares = sorted(((row[status], status) for status in STATUSES if row[status] > 0.0), reverse=True)
    return ", ".join(f"{status.replace('_', ' ')} {percent(share, 0)}" for share, status in shares) or "—"
