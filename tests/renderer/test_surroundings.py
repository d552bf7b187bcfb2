"""Open scenes are told from closed ones, and where lights may be follows from it."""

from __future__ import annotations

import pytest

from lit_room import frozen_cube, frozen_room
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.surroundings import OPEN, REACH

RADIUS = 0.5 * 0.5 * 3.0**0.5


@pytest.fixture(scope="module")
def cube() -> FrozenScene:
    return frozen_cube()


@pytest.fixture(scope="module")
def room() -> FrozenScene:
    return frozen_room()


def test_a_room_is_closed_and_a_cube_open(room: FrozenScene, cube: FrozenScene) -> None:
    # Measured 0.0 and 1.0.
    assert room.openness < 0.1 * OPEN and cube.openness > 0.99
    assert cube.surroundings.open and not room.surroundings.open


def test_lights_are_looked_for_where_they_may_be(room: FrozenScene, cube: FrozenScene) -> None:
    lower, upper = cube.surroundings.bounds
    # Centres of surfels end half a spacing before the cube does.
    assert float((upper - lower).min()) == pytest.approx(2 * REACH * RADIUS, rel=0.11)
    points = cube.surroundings.shell_points()
    assert bool(((points >= lower) & (points <= upper)).all())
    lower, upper = room.surroundings.bounds
    assert float((upper - lower).max()) == pytest.approx(1.5 * room.size)
