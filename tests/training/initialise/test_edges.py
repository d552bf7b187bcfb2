"""Surfels end where their surface does, however it is turned."""

from __future__ import annotations

import numpy as np
import pytest

from rgspipe.scene.surfels import NO_CLIP
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.edges import Through, find_edges

SPACING = 0.1
#: How far surfels are seen that are whole, and that are clipped, in spacings.
SEEN = (0.9, 1.3)


def plate(points: int, turn: float, seed: int) -> tuple[Cloud, np.ndarray]:
    """Points in the unit square, turned in its plane, and the square's axes."""
    flat = np.random.default_rng(seed).uniform(-0.5, 0.5, (points, 2))
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    places = np.column_stack([flat @ axes, np.zeros(points)])
    return Cloud(places, np.broadcast_to([0.0, 0.0, 1.0], places.shape)), axes


def edges_of(turn: float, factor: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres (N, 2) on a plate that is turned, in its own axes, and their clips: (N, 2) how far from the centre of the
    plate each stands, NaN where there is none, and (N, 2) the angles from the plate's axes, at most 45°."""
    cloud, axes = plate(40_000, turn, seed=0)
    steps = SPACING * (np.arange(10) + 0.5) - 0.5
    own = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    centers = Cloud(np.column_stack([own @ axes, np.zeros(len(own))]), np.tile([0.0, 0.0, 1.0], (len(own), 1)))
    frames = np.broadcast_to(np.eye(3), (len(own), 3, 3))
    spacing = np.full(len(own), factor * SPACING)
    offsets, angles = find_edges(centers, frames, cloud, cloud, spacing, SEEN)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1) @ axes.T
    along = np.abs(directions).argmax(axis=-1)
    stand = np.abs(np.take_along_axis(own[:, None] + offsets[..., None] * directions, along[..., None], axis=-1))[
        ..., 0
    ]
    off = np.arcsin(np.abs(directions).min(axis=-1))
    found = offsets < NO_CLIP
    return own, np.where(found, stand, np.nan), np.where(found, off, 0.0)


@pytest.mark.parametrize("degrees", [0.0, 1.2, 2.5, 20.0])
def test_clips_stand_where_the_surface_ends(degrees: float) -> None:
    own, stand, off = edges_of(np.radians(degrees))
    outermost = np.abs(own).max(axis=1) > 0.4
    assert np.isfinite(stand[outermost, 0]).all() and np.isnan(stand[np.abs(own).max(axis=1) < 0.3]).all()
    corners = np.abs(own).min(axis=1) > 0.4
    assert np.isfinite(stand[corners]).all()
    # Three points of 0.005 apart are left out; by steps of 5° alone clips stood up to 0.003 outside.
    assert np.nanmax(stand) < 0.5 + 0.005 * SPACING and np.nanmean(stand) > 0.5 - 0.02 * SPACING
    assert np.degrees(np.median(off[np.isfinite(stand)])) < 1.0  # 0.3


def test_large_surfels_are_clipped_from_farther_away() -> None:
    own, stand, _ = edges_of(0.0, factor=2.0)
    second = np.abs(np.abs(own).max(axis=1) - 0.35) < 1e-9
    assert np.isfinite(stand[second, 0]).all()
    assert np.isnan(edges_of(0.0)[1][second]).all()


def through_a_quarter(places: np.ndarray, normals: np.ndarray, beyond: float) -> np.ndarray:
    """That the quarter x > 0, y > 0 is empty, as photographs would tell it."""
    return (places[:, :2] > 0.0).all(axis=1)


def beside_a_notch(through: Through | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of a plate that lacks a quarter: middles (N, 2) of surfels around the corner that points inwards, how far each
    reaches into what is missing, and its clips (N, 2)."""
    cloud, _ = plate(40_000, 0.0, seed=1)
    cloud = cloud[~(cloud.points[:, :2] > 0.0).all(axis=1)]
    steps = SPACING * (np.arange(6) + 0.5) - 0.3
    own = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    own = own[~(own > 0.0).all(axis=1)]
    centers = Cloud(np.column_stack([own, np.zeros(len(own))]), np.tile([0.0, 0.0, 1.0], (len(own), 1)))
    frames, spacing = np.broadcast_to(np.eye(3), (len(own), 3, 3)), np.full(len(own), SPACING)
    offsets, angles = find_edges(centers, frames, cloud, cloud, spacing, SEEN, through)
    disc = np.random.default_rng(0).uniform(-1.0, 1.0, (4000, 2))
    disc = disc[np.linalg.norm(disc, axis=1) < 1.0]
    seen = disc * np.where(offsets[:, :1] < NO_CLIP, SEEN[1], SEEN[0])[..., None] * SPACING
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    kept = (np.einsum("npd,nkd->npk", seen, directions) <= offsets[:, None]).all(axis=2)
    missing = (seen + own[:, None]).min(axis=2)
    return own, np.where(kept, missing, 0.0).max(axis=1), offsets


def test_surfels_at_a_notch_do_not_hang_over_what_was_looked_through() -> None:
    own, before, whole = beside_a_notch(None)
    _, after, clipped = beside_a_notch(through_a_quarter)
    assert before.max() > 0.4 * SPACING and after.max() < 0.15 * SPACING  # 0.49, 0.10
    far = np.linalg.norm(own, axis=1) > 2.0 * SPACING
    assert np.array_equal(whole[far], clipped[far])


def test_a_notch_that_nobody_looked_through_stays() -> None:
    """Where a thing stands on a floor, what is missing is hidden and does not matter."""
    nowhere = beside_a_notch(lambda places, normals, beyond: np.zeros(len(places), dtype=bool))
    assert np.array_equal(nowhere[2], beside_a_notch(None)[2])
