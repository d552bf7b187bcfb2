"""Fractions as people read them."""

from __future__ import annotations

import math
from typing import Any


def percent(share: Any, digits: int = 2, *, unknown: str = "—", unbounded: str = "∞") -> str:
    """A fraction as percent.

    Args:
        share: a number, or what tables have in the place of one that is not known: None, NaN or NA.
        digits: behind the point.
        unknown: said of what is not known.
        unbounded: said of what is infinite, such as the error of a fit that failed.
    """
    try:
        value = float(share)
    except TypeError:  # None, and the NA of pandas
        return unknown
    if math.isnan(value):
        return unknown
    return unbounded if math.isinf(value) else f"{100.0 * value:.{digits}f} %"
