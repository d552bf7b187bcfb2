"""The car stays on its way: unbroken, in the corridor, its beams ahead."""

from __future__ import annotations

import numpy as np
import pytest

from rgspipe.blender.pool.drive import DIP, GAUGE, headlights, path, path_length
from rgspipe.scene.lights import SpotLight
from rgspipe.scene.models import Corridor

CORRIDORS = [Corridor(), Corridor(width=0.28, height=0.6), Corridor(width=0.36)]
SHAPE = SpotLight.shaped("smoothstep", 0.4, 0.2)


@pytest.mark.parametrize("corridor", CORRIDORS)
def test_the_way_is_smooth_and_as_long_as_it_says(corridor: Corridor) -> None:
    steps = np.linspace(0.0, path_length(corridor), 2001)
    places, ahead = (np.array(values) for values in zip(*(path(corridor, s) for s in steps), strict=True))
    np.testing.assert_allclose(np.linalg.norm(ahead, axis=1), 1.0)
    moved = np.diff(places, axis=0) / np.diff(steps)[:, None]
    # Chords of the bend against its tangents: measured 1.3e-3.
    np.testing.assert_allclose(moved, ahead[:-1], atol=3e-3)
    np.testing.assert_array_equal(ahead[[0, -1]], [[0.0, -1.0], [-1.0, 0.0]])


@pytest.mark.parametrize("corridor", CORRIDORS)
def test_headlights_keep_away_from_the_walls(corridor: Corridor) -> None:
    lights = [light for pair in headlights(corridor, 50, SHAPE) for light in pair]
    x, y, z = np.array([light.position.numpy() for light in lights]).T
    inner, least = 0.5 - corridor.width, 0.35 * corridor.width
    assert np.minimum(0.5 - x, y + 0.5).min() > least  # from the outer walls
    from_inner = np.hypot(np.maximum(x - inner, 0.0), np.minimum(y + inner, 0.0))
    assert from_inner.min() > least
    assert (abs(z) < 0.5 * corridor.height - 0.1 * corridor.width).all()


def test_a_pair_is_side_by_side_and_shines_ahead() -> None:
    corridor = Corridor()
    moments = np.linspace(0.0, path_length(corridor), 9)
    for moment, (left, right) in zip(moments, headlights(corridor, 9, SHAPE), strict=True):
        middle, ahead = path(corridor, float(moment))
        across = (left.position - right.position).numpy()
        assert np.linalg.norm(across) == pytest.approx(GAUGE * corridor.width)
        assert across[:2] @ ahead == pytest.approx(0.0, abs=1e-12)
        assert ahead[0] * across[1] - ahead[1] * across[0] > 0.0  # the left one to the left
        np.testing.assert_allclose(0.5 * (left.position + right.position)[:2].numpy(), middle)
        for light in (left, right):
            assert np.linalg.norm(light.direction) == pytest.approx(1.0)
            assert light.direction[:2].numpy() @ ahead == pytest.approx(np.cos(DIP))
            assert (light.cone_angle, light.falloff) == (SHAPE.cone_angle, SHAPE.falloff)


def test_a_single_moment_is_the_first() -> None:
    corridor = Corridor()
    [pair] = headlights(corridor, 1, SHAPE)
    np.testing.assert_array_equal(pair[0].position, headlights(corridor, 5, SHAPE)[0][0].position)
