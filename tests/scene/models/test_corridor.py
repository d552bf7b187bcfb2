"""The corridor as rectangles: furniture stands on its floor, and places are told from the ends of its legs."""

from __future__ import annotations

import pytest

from rgspipe.scene.models import Corridor


def test_furniture_stands_on_the_floor_inside_the_walls() -> None:
    corridor = Corridor()
    corners = corridor.rectangles().corners[-6 * len(corridor.furniture()) :]
    assert float(corners[..., 2].min()) == pytest.approx(-0.5 * corridor.height)
    assert float(corners[..., 2].max()) < 0.5 * corridor.height and float(corners.abs().max()) < 0.5


def test_places_are_told_from_the_ends_of_the_legs() -> None:
    corridor = Corridor(width=0.3)
    assert corridor.place("near", 1.0, 0.0) == pytest.approx((-0.2, -0.5))
    assert corridor.place("far", 1.0, 0.0) == pytest.approx((0.5, 0.2))
    # Both legs end in the same corner.
    assert corridor.place("near", 1.0 / 0.3, 0.5) == pytest.approx((0.5, -0.35))
    assert corridor.place("far", 1.0 / 0.3, 0.5) == pytest.approx((0.35, -0.5))
