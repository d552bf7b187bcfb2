"""What a fit says to be in doubt."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from rgspipe.fitting.certainty.doubts import distance_to_surface, doubts
from rgspipe.fitting.findings import OnSurface, RoughShape, Uncertain
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.scene import PointLight, Surfels
from rgspipe.scene.lights import PanelLight, SphereLight
from rgspipe.scene.rectangles import rectangle, surfels_on

SURE, FAR = 1e-4 * torch.eye(6), torch.diag(torch.tensor([0.01, 0.02, 0.06, 9.0, 9.0, 9.0]))


def light_at(*place: float) -> PointLight:
    return PointLight(torch.tensor(place, dtype=torch.float64), torch.ones(3, dtype=torch.float64))


@pytest.fixture(scope="module")
def floor() -> Surfels:
    """A square from 0 to 1 at z = 0."""
    return surfels_on(rectangle([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5] * 3), 400)


def test_positions_that_may_be_far_off_are_said_to_be(floor: Surfels) -> None:
    light = light_at(0.5, 0.5, 0.4)
    assert doubts((light,), (SURE,), floor, 1.0) == [] == doubts((light,), (FAR,), floor, 100.0)
    assert doubts((light,), (FAR,), floor, 1.0) == [Uncertain(1, 1, pytest.approx(0.3))]
    assert doubts((light, light), (SURE, FAR), floor, 2.0) == [Uncertain(2, 2, pytest.approx(0.15))]


def test_a_light_that_stands_on_a_surface_is_said_to(floor: Surfels) -> None:
    above, on, behind = (light_at(0.31, 0.52, height * CertaintyOptions().on_surface) for height in (1.1, 0.9, -0.9))
    assert doubts((above,), (SURE,), floor, 1.0) == []
    for light in (on, behind):
        assert doubts((light,), (SURE,), floor, 1.0) == [OnSurface(1, 1)]
    assert doubts((above, on), (SURE, SURE), floor, 1.0) == [OnSurface(2, 2)]
    assert doubts((on, above, behind), 3 * (SURE,), floor, 1.0) == [OnSurface(1, 3), OnSurface(3, 3)]


def test_sizes_that_are_hardly_known_are_said_to_be(floor: Surfels) -> None:
    """Lengths by their share, an angle by that of one of which nothing is known: π/√12 for a turn."""
    place, limit = [0.5, 0.5, 0.4], CertaintyOptions().rough
    variances = torch.cat([torch.full((6,), 1e-8), torch.tensor([0.04, 0.01, 0.1]).square(), torch.full((3,), 1e-8)])
    panel = PanelLight(place, 1.0, [0.0, 0.0, -1.0], 0.3, 0.05, 0.2)
    [found] = doubts((panel,), (torch.diag(variances),), floor, 1.0)
    assert found == RoughShape(1, 1, ("height",), (pytest.approx(0.2),))
    [found] = doubts((panel,), (torch.diag(9.0 * variances),), floor, 1.0)
    assert found.fields == ("width", "height", "turn")
    assert found.errors == pytest.approx((0.4, 0.6, 0.3 * math.sqrt(12.0) / math.pi))
    for radius, told in ((1.01 * 0.01 / limit, True), (0.99 * 0.01 / limit, False)):
        matrix = torch.diag(torch.tensor([1e-8, 1e-8, 1e-8, 1e-4, 1e-8, 1e-8, 1e-8]))
        assert (doubts((SphereLight(place, 1.0, radius),), (matrix,), floor, 1.0) == []) is told


@given(x=st.floats(0.05, 0.95), y=st.floats(0.05, 0.95), z=st.floats(-10.0, 10.0))
def test_the_distance_to_a_surface_is_that_to_its_plane(floor: Surfels, x: float, y: float, z: float) -> None:
    assert distance_to_surface(floor, torch.tensor([x, y, z])) == pytest.approx(abs(z), abs=1e-6)


def test_beside_a_surface_there_is_none(floor: Surfels) -> None:
    assert distance_to_surface(floor, torch.tensor([1.5, 0.5, 0.0])) == math.inf
