"""Fractions are told alike wherever they are read."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from rgspipe.percent import percent


@pytest.mark.parametrize(
    ("share", "digits", "told"),
    [
        (0.12345, 2, "12.35 %"),
        (np.float32(0.5), 0, "50 %"),
        (1, 1, "100.0 %"),
        (-0.01, 0, "-1 %"),
        (math.inf, 2, "∞"),
        (math.nan, 2, "—"),
        (None, 2, "—"),
        (pd.NA, 2, "—"),
    ],
)
def test_a_fraction_is_told_in_percent(share: object, digits: int, told: str) -> None:
    assert percent(share, digits) == told


def test_what_is_no_number_is_told_in_other_words_where_these_are_wanted() -> None:
    assert percent(math.nan, unknown="") == "" and percent(math.inf, unbounded="unbounded") == "unbounded"
    with pytest.raises(ValueError, match="far"):
        percent("far")
