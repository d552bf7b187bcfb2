"""Spots are aimed at what the camera sees, or at what hands light on to it, in a world simple enough to know both."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from rgspipe.blender.pool.aim import MIN_SPOT_SHARE, aim_at_relay, aim_at_seen, seen_points
from rgspipe.scene import Camera, look_at
from rgspipe.scene.lights import SpotLight

SHAPE = SpotLight.shaped("smoothstep", 0.3, 0.2)


class _Floor:
    """The plane z = 0, seen from above, and a wall at x = 0 up to the height `wall`."""

    def __init__(self, wall: float = 0.0) -> None:
        self._wall = wall

    def cast(self, origin: np.ndarray, direction: np.ndarray) -> tuple[float, bool]:
        hits = []
        if direction[2] < 0.0:
            hits.append(-origin[2] / direction[2])
        if direction[0] != 0.0:
            distance = -origin[0] / direction[0]
            if distance > 0.0 and 0.0 < origin[2] + distance * direction[2] < self._wall:
                hits.append(distance)
        return (min(hits), True) if hits else (math.inf, False)

    def blocked(self, start: np.ndarray, end: np.ndarray) -> bool:
        step = end - start
        length = float(np.linalg.norm(step))
        return self.cast(start, step / length)[0] < length


def _seen(geometry: _Floor, x: float) -> np.ndarray:
    """What a camera two above (x, 0, 0) sees, about 1.1 across."""
    pose = look_at(torch.tensor([x, 0.0, 2.0]), torch.tensor([x, 1e-3, 0.0]))
    return seen_points(Camera.from_field_of_view(pose, math.radians(30.0), 8, 8), geometry)


def test_seen_points_are_on_the_surface_behind_the_image() -> None:
    seen = _seen(_Floor(), 1.0)
    assert seen.shape == (100, 3)
    np.testing.assert_allclose(seen[:, 2], 0.0, atol=2e-4)  # before it by 1e-4
    assert abs(seen[:, 0] - 1.0).max() < 2.0 * math.tan(math.radians(15.0))


def test_nothing_is_seen_of_an_empty_world() -> None:
    up = look_at(torch.tensor([0.0, 0.0, 1.0]), torch.tensor([0.0, 1e-3, 2.0]))
    seen = seen_points(Camera.from_field_of_view(up, 0.5, 8, 8), _Floor())
    assert seen.shape == (0, 3)
    assert aim_at_seen(np.random.default_rng(0), np.ones(3), SHAPE, seen, _Floor()) is None
    assert aim_at_relay(np.random.default_rng(0), np.ones(3), seen, _Floor()) is None


@pytest.mark.parametrize("seed", range(5))
def test_a_spot_lights_what_is_seen(seed: int) -> None:
    seen, position = _seen(_Floor(), 1.0), np.array([-0.5, 0.3, 0.8])
    axis = aim_at_seen(np.random.default_rng(seed), position, SHAPE, seen, _Floor())
    towards = seen - position
    cosine = towards @ axis / np.linalg.norm(towards, axis=1)
    assert np.linalg.norm(axis) == pytest.approx(1.0)
    assert np.mean(cosine > math.cos(SHAPE.cone_angle)) >= MIN_SPOT_SHARE


def test_a_spot_behind_a_wall_can_not_light_what_is_seen() -> None:
    wall = _Floor(wall=10.0)
    assert aim_at_seen(np.random.default_rng(0), np.array([-0.5, 0.0, 0.5]), SHAPE, _seen(wall, 1.0), wall) is None


def test_a_relay_is_in_sight_of_what_is_seen() -> None:
    wall = _Floor(wall=0.2)
    seen, position = _seen(wall, 1.0), np.array([0.5, 0.0, 0.15])
    axis = aim_at_relay(np.random.default_rng(0), position, seen, wall)
    distance, _ = wall.cast(position, axis)
    assert (position + distance * axis)[0] > -1e-9  # not over the wall, where nothing that is seen is in sight
