"""Noisy depth with gaps, from many views, becomes one surface: flat, curved, with and without a normal pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from curved import torus_distance, torus_normals, torus_views
from raycast import BLOCK, ROOM, room_views, surface_distance
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_views import degraded
from rgspipe.degradation.options import ViewErrors
from rgspipe.errors import InputError
from rgspipe.scene import Camera
from rgspipe.training.initialise import cloud_from_views, initialise_surfels, see_surfaces


@pytest.fixture(scope="module")
def room() -> list[View]:
    return room_views(24, 64, normals=True)


@pytest.fixture(scope="module")
def torus() -> list[View]:
    return torus_views(24, 64)


def degrees_off(normals: np.ndarray) -> np.ndarray:
    """Angle [°] to the nearest normal that the room or the block has."""
    true = np.concatenate([ROOM.axes, BLOCK.axes])
    return np.degrees(np.arccos(np.clip(np.abs(normals @ true.T).max(axis=1), 0.0, 1.0)))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


@pytest.mark.parametrize(
    "capture, turn, off",
    [
        (ViewErrors(depth_noise=0.01, normals=False), 0.2, 0.001),  # measured 0.095, 5.3e-4
        (ViewErrors(depth_noise=0.03, normals=False), 0.6, 0.006),  # measured 0.194, 3.1e-3
        (ViewErrors(depth_noise=0.01, depth_missing=0.2, normals=False), 0.2, 0.0015),  # measured 0.104, 7.6e-4
        (ViewErrors(depth_noise=0.01), 0.2, 0.001),  # measured 0.084, 2.2e-4
    ],
    ids=["1 %", "3 %", "1 % with gaps", "1 % with normals"],
)
def test_flat_surfaces_come_out_of_noise(room: list[View], capture: ViewErrors, turn: float, off: float) -> None:
    surfels = initialise_surfels(degraded(room, capture), 1500, seed=0)
    angle, distance = degrees_off(surfels.normals.double().numpy()), surface_distance(surfels.centers.double().numpy())
    assert np.median(angle) < turn
    assert rms(distance) < off


def test_a_curved_surface_comes_out_of_noise(torus: list[View]) -> None:
    noisy = degraded(torus, ViewErrors(depth_noise=0.01))
    seen, cloud = see_surfaces(noisy), cloud_from_views(noisy, 1500)
    angle = np.degrees(np.arccos(np.clip((torus_normals(cloud.points) * cloud.normals).sum(axis=1), -1.0, 1.0)))
    assert len(cloud) > 0.9 * len(seen)  # measured 0.999
    assert np.median(angle) < 1.5  # measured 0.75
    assert rms(torus_distance(cloud.points)) < 0.3 * rms(torus_distance(seen.measured_points))  # measured 0.18


@pytest.mark.parametrize("share", [0.01, 0.3, 0.9])
def test_an_even_part_of_many_pixels_is_kept(room: list[View], share: float) -> None:
    every = see_surfaces(room)
    part = see_surfaces(room, most=share * sum(view.depth.numel() for view in room))
    assert len(part) == pytest.approx(share * len(every), rel=0.06)  # measured 0.037 at most
    known = {tuple(point) for point in every.measured_points.round(9)}
    assert all(tuple(point) in known for point in part.measured_points.round(9))
    # Each corner of the room has its share.
    corner = [(one.points > np.median(every.points, axis=0)).all(axis=1).sum() for one in (every, part)]
    assert corner[1] == pytest.approx(share * corner[0], rel=0.2)  # measured 0.09 at most


def test_exact_depth_is_left_as_it_is(room: list[View]) -> None:
    bare = degraded(room[:4], ViewErrors(normals=False))
    cloud, seen = cloud_from_views(bare, 500), see_surfaces(bare)
    assert not seen.noisy
    assert np.array_equal(cloud.points, seen.measured_points)


def test_gaps_in_exact_depth_cost_no_accuracy(room: list[View]) -> None:
    cloud = cloud_from_views(degraded(room[:12], ViewErrors(depth_missing=0.3, normals=False)), 500)
    assert surface_distance(cloud.points).max() < 1e-6  # measured 5e-8, float32 depth
    assert np.percentile(degrees_off(cloud.normals), 99) < 0.01  # measured 1e-4


def test_what_no_other_view_confirms_is_left_out(room: list[View]) -> None:
    """One view measures a screen in the middle of the room, through which all others see."""
    noisy = list(degraded(room, ViewErrors(depth_noise=0.01, normals=False)))
    wrong = noisy[0].depth.clone()
    wrong[10:30, 10:30] = 0.3 * (1.0 + 0.01 * torch.randn(20, 20, generator=torch.Generator().manual_seed(0)))
    views = [replace(noisy[0], depth=wrong), *noisy[1:]]
    assert (surface_distance(see_surfaces(views).points) > 0.05).sum() >= 380
    away = surface_distance(cloud_from_views(views, 1500).points)
    assert away.max() < 0.05  # measured 0.034; the screen is 0.061 away and more


@settings(max_examples=8, deadline=None)
@given(
    count=st.integers(1, 4),
    noise=st.floats(1e-3, 0.2),
    missing=st.sampled_from([0.0, 0.2, 0.8]),
    far=st.sampled_from([0.0, 1e4]),
)
def test_any_capture_gives_finite_points_and_unit_normals(
    room: list[View], count: int, noise: float, missing: float, far: float
) -> None:
    noisy = degraded(room[:count], ViewErrors(depth_noise=noise, depth_missing=missing, normals=False))
    moved = [replace(view, camera=_shifted(view.camera, far)) for view in noisy]
    try:
        cloud = cloud_from_views(moved, 200)
    except InputError:
        return
    assert np.isfinite(cloud.points).all()
    assert np.abs(np.linalg.norm(cloud.normals, axis=1) - 1.0).max() < 1e-9


def _shifted(camera: Camera, far: float) -> Camera:
    pose = camera.camera_to_world.clone()
    pose[:3, 3] += far
    return replace(camera, camera_to_world=pose)


def test_the_same_views_give_the_same_surface(room: list[View]) -> None:
    noisy = degraded(room[:10], ViewErrors(depth_noise=0.01, normals=False))
    first, again = cloud_from_views(noisy, 500), cloud_from_views(noisy, 500)
    assert np.array_equal(first.points, again.points)
    assert np.array_equal(first.normals, again.normals)
