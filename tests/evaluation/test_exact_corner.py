"""The corridor as rectangles: closed, facing inwards, and with the furniture that Blender draws."""

from __future__ import annotations

import pytest
import torch

from rgspipe.blender.models.corridor import FURNITURE
from rgspipe.blender.models.parameters import CornerParameters
from rgspipe.evaluation.exact_corner import corner_rectangles


@pytest.mark.parametrize("corridor", [CornerParameters(), CornerParameters(width=0.28, height=0.6)])
def test_walls_close_the_corridor(corridor: CornerParameters) -> None:
    """Gauss: over a closed surface the areas with their normals sum to nothing, and with their places to the volume."""
    walls = corner_rectangles(corridor)
    shell = slice(0, len(walls) - 6 * len(FURNITURE))
    vectors = torch.linalg.cross(walls.sides_a, walls.sides_b)[shell]
    middles = walls.corners.mean(dim=1)[shell]
    floor = 1.0 - (1.0 - corridor.width) ** 2
    torch.testing.assert_close(vectors.sum(dim=0), torch.zeros(3).double(), rtol=0, atol=1e-12)
    # Normals look into the corridor, so the volume is negative.
    assert float((vectors * middles).sum() / 3.0) == pytest.approx(-floor * corridor.height, rel=1e-12)


def test_furniture_stands_on_the_floor_inside_the_walls() -> None:
    corridor = CornerParameters()
    corners = corner_rectangles(corridor).corners[-6 * len(FURNITURE) :]
    assert float(corners[..., 2].min()) == pytest.approx(-0.5 * corridor.height)
    assert float(corners[..., 2].max()) < 0.5 * corridor.height and float(corners.abs().max()) < 0.5
