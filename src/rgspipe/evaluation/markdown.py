"""Tables as Markdown, as they stand in docs/."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import pandas as pd


def markdown_table(table: pd.DataFrame, columns: Mapping[str, tuple[str, str]]) -> str:
    """A Markdown table.

    Args:
        columns: for each column that is shown its heading and format, such as ("PSNR (dB)", ".1f").
    """
    shown = {name: style for name, style in columns.items() if name in table.columns}
    rows = table.to_dict("records")
    cells = [[_cell(row[name], form) for name, (_, form) in shown.items()] for row in rows]
    return markdown_lines([heading for heading, _ in shown.values()], cells)


def markdown_lines(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table of texts."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _cell(value: object, form: str) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) and math.isinf(value):
        return "∞"
    return format(value, form) if form else str(value)
