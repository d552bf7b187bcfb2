"""Rooms above floors with right angles are closed and face inwards."""

from __future__ import annotations

from itertools import accumulate

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.scene.models import Corridor, FloorPlan

GREY = (0.5, 0.5, 0.5)


def check_closed(plan: FloorPlan, floor: float) -> None:
    """Gauss: over a closed surface the areas with their normals sum to nothing, and with their places to the volume."""
    surfaces = plan.rectangles()
    vectors = torch.linalg.cross(surfaces.sides_a, surfaces.sides_b)
    torch.testing.assert_close(vectors.sum(dim=0), torch.zeros(3).double(), rtol=0, atol=1e-12)
    # Normals look inwards, so the volume is negative.
    volume = -floor * plan.height
    assert float((vectors * surfaces.corners.mean(dim=1)).sum() / 3.0) == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("corridor", [Corridor(), Corridor(width=0.28, height=0.6)])
def test_the_corridor_is_closed(corridor: Corridor) -> None:
    check_closed(corridor.plan(), 1.0 - (1.0 - corridor.width) ** 2)


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.1, 1.0), st.floats(0.1, 1.0)), min_size=1, max_size=4), st.floats(0.1, 2.0))
def test_stairs_are_closed(steps: list[tuple[float, float]], height: float) -> None:
    """A floor below steps, each (wide, high), that go up to the right."""
    x, y = (list(accumulate(sizes, initial=0.0)) for sizes in zip(*steps, strict=True))
    treads = [corner for k in reversed(range(len(steps))) for corner in ((x[k + 1], y[k + 1]), (x[k], y[k + 1]))]
    outline = ((0.0, 0.0), (x[-1], 0.0), *treads)
    plan = FloorPlan(outline, height, (GREY,) * len(outline), GREY, GREY)
    check_closed(plan, sum(wide * top for (wide, _), top in zip(steps, y[1:], strict=True)))


def test_walls_have_the_colours_of_the_corners_at_which_they_begin() -> None:
    corridor = Corridor()
    walls = corridor.plan().wall_rectangles()
    near_end = walls.corners.mean(dim=1)[:, 0] == -0.5
    assert walls.albedo[near_end].tolist() == [pytest.approx(corridor.near_end)]
    far_end = walls.corners.mean(dim=1)[:, 1] == 0.5
    assert walls.albedo[far_end].tolist() == [pytest.approx(corridor.far_end)]
