"""Tables and numbers as the terminal shows them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows, the first of them headings, as lines: words to the left, columns with digits to the right."""
    aligned = []
    for index, column in enumerate(zip(*rows, strict=True)):
        width = max(map(len, column))
        to_left = index == 0 or not any(character.isdigit() for cell in column[1:] for character in cell)
        aligned.append([cell.ljust(width) if to_left else cell.rjust(width) for cell in column])
    return [f"  {'  '.join(row)}".rstrip() for row in zip(*aligned, strict=True)]


def without_empty(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Rows without the columns that are empty in all but the first."""
    kept = [index for index in range(len(rows[0])) if any(row[index] for row in rows[1:])]
    return [[row[index] for index in kept] for row in rows]


def words(name: object) -> str:
    """A status in words; nothing where there is none."""
    return "" if pd.isna(name) else str(name).replace("_", " ")


def seconds(value: object) -> str:
    """Seconds; nothing where they are not known."""
    return "" if pd.isna(value) else f"{float(value):.2f} s"


def time(values: pd.Series) -> str:
    """The median of times [s], and the worst."""
    return f"{seconds(values.median())} (worst {seconds(values.max())})"


def percent(value: object, digits: int = 2) -> str:
    """A fraction as percent; nothing where it is not known, words where it is infinite."""
    if pd.isna(value):
        return ""
    return "unbounded" if math.isinf(float(value)) else f"{100.0 * float(value):.{digits}f} %"


def degrees(value: object) -> str:
    """An angle; nothing where there is none."""
    return "" if pd.isna(value) or math.isinf(float(value)) else f"{float(value):.2f}°"


def decibels(value: object) -> str:
    """A PSNR; nothing where it is not known."""
    return "" if pd.isna(value) else f"{float(value):.1f} dB"
