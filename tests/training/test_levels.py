"""Errors are measured against what a view should show, so that a dark photograph does not count for all others."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from rgspipe.training.levels import level, levels, peak


def image(value: float) -> torch.Tensor:
    return torch.full((100, 3), value)


def test_a_photograph_that_is_dark_where_light_is_expected_has_the_level_of_what_is_expected() -> None:
    shown = [image(value) for value in (2.0, 4.0, 6.0, 8.0)]
    photographs = [image(value) for value in (1.0, 2.0, 3.0, 1e-3)]
    found = [float(value) for value in levels(photographs, shown)]
    assert found == pytest.approx([1.0, 2.0, 3.0, 4.0])
    assert float(level(photographs[3], shown[3])) == 8.0 and float(level(shown[3], photographs[3])) == 8.0


def test_views_that_show_nothing_have_a_level_above_zero() -> None:
    assert float(peak(image(0.0))) > 0.0
    assert all(float(value) > 0.0 for value in levels([image(0.0)] * 2, [image(0.0), image(1.0)]))
    assert levels([], []) == []


@given(scale=st.floats(1e-6, 1e20))
def test_levels_go_with_the_unit_of_radiance(scale: float) -> None:
    shown, photographs = [image(2.0), image(4.0), image(5.0)], [image(1.0), image(1e-3), image(2.5)]
    scaled = levels([scale * one for one in photographs], shown)
    for found, expected in zip(scaled, levels(photographs, shown), strict=True):
        assert float(found) == pytest.approx(scale * float(expected), rel=1e-5)  # Measured 3e-7, float32.
