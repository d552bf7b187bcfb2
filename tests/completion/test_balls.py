"""Balls of which a part was seen, and what is none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rgspipe.completion.balls import ASKEW, FEWEST, SPREAD, _fitted, ball_of, balls_among
from rgspipe.renderer.point_sets import fibonacci_directions
from rgspipe.scene.rectangles import solid_box, surfels_on

#: Distance of surfels, and where the ball is and how large.
SPACING, MIDDLE, RADIUS = 0.03, np.array([1.0, 2.0, 0.5]), 0.3


def cap(half_angle: float, off: float, askew: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and normals of surfels of the ball around +x, up to `half_angle` [rad], with errors of these deviations.

    Args:
        off: of places along the normal, scene units.
        askew: of normals, rad.
    """
    rng = np.random.default_rng(seed)
    ways = fibonacci_directions(round(4.0 * np.pi * RADIUS**2 / SPACING**2)).double().numpy()
    ways = ways[ways[:, 0] > math.cos(half_angle)]
    normals = ways + askew * rng.normal(size=ways.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return MIDDLE + (RADIUS + off * rng.normal(size=(len(ways), 1))) * ways, normals


def drum_wall() -> tuple[np.ndarray, np.ndarray]:
    """A third of the side of an upright drum as wide as the ball."""
    turns, levels = np.arange(-1.0, 1.0, SPACING / RADIUS), np.arange(-0.3, 0.3, SPACING)
    turn, level = (part.reshape(-1) for part in np.meshgrid(turns, levels, indexing="ij"))
    normals = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    return RADIUS * normals + np.stack([0.0 * level, 0.0 * level, level], axis=1), normals


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_part_of_a_ball_among_other_surfaces_tells_all_of_it(seed: int) -> None:
    """A ninth of it, places off by a thirtieth of their distance and normals by 3°, beside a box and a wall."""
    places, normals = cap(0.7, 0.001, 0.05, seed)
    box = surfels_on(solid_box([1.6, 2.0, 0.3], [0.6, 0.4, 0.6], [0.5] * 3, 0.3), 1500)
    centers = np.concatenate([box.centers.double().numpy(), places])
    (ball,) = balls_among(centers, np.concatenate([box.normals.double().numpy(), normals]), SPACING)
    # Measured 0.063 distances of surfels.
    assert max(np.abs(ball.middle - MIDDLE).max(), abs(ball.radius - RADIUS)) < 0.2 * SPACING
    assert len(ball.members) > 0.95 * len(places)  # measured 1.0
    whole = ball.all_around(SPACING)
    np.testing.assert_allclose(np.linalg.norm(whole.places - ball.middle, axis=1), ball.radius, rtol=1e-6)
    assert len(whole) == pytest.approx(4.0 * np.pi * (RADIUS / SPACING) ** 2, rel=0.05)


def test_places_tell_a_ball_far_better_than_normals_do() -> None:
    """Normals are 6° off, and places right; with all residuals of p = m + R n alike middles are up to 0.029 off."""
    errors = []
    for seed in range(8):
        places, normals = cap(0.7, 1e-4, 0.1, seed)
        ball = ball_of(places, normals, np.arange(len(places)), SPACING)
        assert ball is not None
        errors.append(np.abs(ball.middle - MIDDLE).max())
    assert max(errors) < 0.02 * SPACING  # measured 0.0052, and 0.98 by p = m + R n alone


def test_what_is_no_ball_or_does_not_tell_one_is_left() -> None:
    """A drum bends one way only; a small cap, rough places or few surfels leave open which ball it is."""
    assert not balls_among(*drum_wall(), SPACING)
    box = surfels_on(solid_box([0.0, 0.0, 0.3], [0.6, 0.4, 0.6], [0.5] * 3, 0.3), 1500)
    assert not balls_among(box.centers.double().numpy(), box.normals.double().numpy(), SPACING)
    assert not balls_among(*cap(0.4 * SPREAD, 1e-4, 0.01, 0), SPACING)
    assert not balls_among(*cap(0.7, SPACING, 0.4 * ASKEW, 0), SPACING)
    flat = np.random.default_rng(0).uniform(size=(200, 3)) * [1.0, 1.0, 0.0]
    assert ball_of(flat, np.tile([0.0, 0.0, 1.0], (200, 1)), np.arange(200), SPACING) is None
    few = [part[: FEWEST - 1] for part in cap(1.2, 1e-4, 0.01, 0)]
    assert not balls_among(*few, SPACING) and ball_of(*few, np.arange(FEWEST - 1), SPACING) is None


@pytest.mark.parametrize("off", [0.002, 0.004])
def test_what_a_ball_is_thought_to_be_off_by_is_what_it_is_off_by(off: float) -> None:
    """The covariance that decides whether a ball is told, against sixty drawn ones."""
    scaled = []
    for seed in range(60):
        middle, radius, covariance = _fitted(*cap(0.9, off, 0.05, seed))
        error = np.array([*(middle - MIDDLE), radius - RADIUS])
        scaled.append(error @ np.linalg.solve(covariance, error) / 4.0)
    assert 0.8 < np.mean(scaled) < 1.3  # measured 1.05 and 1.03
