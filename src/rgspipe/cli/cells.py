"""Numbers and words of tables as the terminal shows them."""

from __future__ import annotations

import math

import pandas as pd

from rgspipe.percent import percent as told


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
    return told(value, digits, unknown="", unbounded="unbounded")


def degrees(value: object) -> str:
    """An angle; nothing where there is none."""
    return "" if pd.isna(value) or math.isinf(float(value)) else f"{float(value):.2f}°"


def decibels(value: object) -> str:
    """A PSNR; nothing where it is not known."""
    return "" if pd.isna(value) else f"{float(value):.1f} dB"
