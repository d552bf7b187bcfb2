"""Depth to surfels, on scenes that a few lines of analytic ray casting know exactly.

Tolerances carry the measured value in a comment.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from raycast import BLOCK, ROOM, Cuboid, room_views, surface_distance, view_of
from rgspipe.errors import InputError
from rgspipe.scene import NO_CLIP, Surfels
from rgspipe.training.initialise import cloud_from_views, initialise_surfels
from rgspipe.training.initialise.normals import normals_from_depth

COUNT = 1500


@pytest.fixture(scope="module")
def views():
    return room_views(24)


@pytest.fixture(scope="module")
def surfels(views) -> Surfels:
    return initialise_surfels(views, COUNT, seed=0)


def degrees_off(normals: np.ndarray) -> np.ndarray:
    """Angle [°] to the nearest normal that the room or the block has."""
    true = np.concatenate([ROOM.axes, BLOCK.axes])
    return np.degrees(np.arccos(np.clip(np.abs(normals @ true.T).max(axis=1), 0.0, 1.0)))


def plane_depth(normal: np.ndarray, size: int = 32, focal: float = 40.0) -> np.ndarray:
    """Planar depth of the plane n·p = −1 (camera axes) at pixel centres."""
    pixel = (np.arange(size) + 0.5 - 0.5 * size) / focal
    x, y = np.meshgrid(pixel, -pixel)
    return -1.0 / (normal[0] * x + normal[1] * y - normal[2])


def test_normals_of_a_slanted_plane_are_exact():
    normal = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    fits = normals_from_depth(plane_depth(normal), (40.0, 40.0), (16.0, 16.0))
    assert fits.valid.all()
    assert np.abs(fits.normals - normal).max() < 1e-6  # measured 3e-15


def test_normals_beside_an_edge_are_those_of_their_own_side():
    left, right = np.array([0.6, 0.0, 0.8]), np.array([-0.6, 0.0, 0.8])
    depth = np.maximum(plane_depth(left), plane_depth(right))  # a valley along the middle column
    fits = normals_from_depth(depth, (40.0, 40.0), (16.0, 16.0))
    found, valid = fits.normals, fits.valid
    assert valid.all()
    assert np.abs(found[:, :16] - found[0, 0]).max() < 1e-6
    assert np.abs(found[:, 16:] - found[0, -1]).max() < 1e-6
    assert np.abs(np.sort([found[0, 0, 0], found[0, -1, 0]]) - [-0.6, 0.6]).max() < 1e-6


def test_normals_where_there_is_no_surface_are_zero():
    depth = plane_depth(np.array([0.0, 0.0, 1.0]))
    depth[:, 20:] = np.inf
    fits = normals_from_depth(depth, (40.0, 40.0), (16.0, 16.0))
    found, valid = fits.normals, fits.valid
    assert valid[:, :20].all()
    assert not valid[:, 20:].any()
    assert not found[~valid].any()


def test_noisy_depth_gets_larger_windows():
    normal = np.array([0.0, 0.6, 0.8])
    noise = 1.0 + 0.01 * np.random.default_rng(0).standard_normal((64, 64))
    depth = plane_depth(normal, 64, 80.0) * noise
    small = normals_from_depth(depth, (80.0, 80.0), (32.0, 32.0), radius=1)
    chosen = normals_from_depth(depth, (80.0, 80.0), (32.0, 32.0))
    assert chosen.valid.mean() > 0.9
    assert (chosen.normals[chosen.valid] @ normal).mean() > 0.95 > (small.normals[small.valid] @ normal).mean()


def test_points_and_normals_are_on_the_surfaces(views):
    cloud = cloud_from_views(views, COUNT)
    assert len(cloud) > 0.97 * 24 * 64 * 64  # measured 0.994
    assert surface_distance(cloud.points).max() < 1e-6  # measured 5e-8, float32 depth
    assert degrees_off(cloud.normals).max() < 0.01  # measured 2e-4


def test_surfels_lie_on_the_surfaces(surfels):
    assert len(surfels) == COUNT
    assert surface_distance(surfels.centers.double().numpy()).max() < 1e-6  # measured 2e-8
    assert degrees_off(surfels.normals.double().numpy()).max() < 0.05  # measured 0.02, rounding to float32


def test_normals_face_the_side_that_was_seen(surfels):
    ahead = surfels.centers + 0.02 * surfels.normals
    assert (ahead.abs() < 0.5).all()
    assert not (np.abs(BLOCK.local(ahead.double().numpy())) < 0.5 * np.array(BLOCK.size)).all(axis=1).any()


def test_surfels_are_evenly_spaced(surfels):
    inside = (surfels.clip_offsets[:, 0] == NO_CLIP).numpy()
    nearest = cKDTree(surfels.centers.numpy()).query(surfels.centers.numpy()[inside], k=2)[0][:, 1]
    # A uniformly random set of points has a ratio of 0.52, a hexagonal grid 0.
    assert nearest.std() / nearest.mean() < 0.2  # measured 0.146


def test_every_seen_point_is_near_a_surfel(views, surfels):
    cloud = cloud_from_views(views, COUNT)
    spacing = float(surfels.coverage.clip_softness) / 0.12
    away = cKDTree(surfels.centers.numpy()).query(cloud.points)[0]
    assert np.percentile(away, 99) < 0.9 * spacing  # measured 0.70
    assert away.max() < 1.7 * spacing  # measured 1.34


def test_scale_follows_the_spacing(surfels):
    whole = surfels.clip_offsets[:, 0] == NO_CLIP
    spacing = surfels.coverage.clip_softness / 0.12
    assert float(surfels.scales[whole].median()) == pytest.approx(0.6 * spacing, rel=0.05)
    round_ones = (surfels.scales[:, 1] == surfels.scales[:, 0])[whole]
    assert round_ones.float().mean() > 0.8  # measured 1.0


def footprint_points(surfels: Surfels, chosen: torch.Tensor) -> torch.Tensor:
    """(M, K, 3) points of the chosen surfels' planes where their opacity is above half of its greatest value."""
    step = torch.linspace(-1.5, 1.5, 31)
    grid = torch.stack(torch.meshgrid(step, step, indexing="ij"), dim=-1).reshape(1, -1, 2)
    local = grid * surfels.scales[chosen, None]
    alpha = torch.exp(-0.5 * (grid**2).sum(-1)).expand(len(local), -1).clone()
    for k in range(2):
        angle, offset = surfels.clip_angles[chosen, k], surfels.clip_offsets[chosen, k]
        along = local @ torch.stack([angle.cos(), angle.sin()], dim=-1)[..., None]
        ramp = 0.5 + (offset[:, None] - along[..., 0]) / surfels.coverage.clip_softness
        alpha = alpha * ramp.clamp(0.0, 1.0)
    frames = surfels.frames[chosen]
    points = surfels.centers[chosen, None] + torch.einsum("mkc,mcd->mkd", local, frames[:, :2])
    return torch.where((alpha > 0.5)[..., None], points, surfels.centers[chosen, None])


def overhang(surfels: Surfels) -> np.ndarray:
    """(M,) how far the footprints of the surfels on the block's top go beyond its border, scene units."""
    top = (surfels.centers[:, 2] + 0.1).abs() < 1e-4
    points = footprint_points(surfels, top & (surfels.normals[:, 2] > 0.99))
    local = BLOCK.local(points.reshape(-1, 3).double().numpy()).reshape(points.shape)
    return (np.abs(local[..., :2]) - 0.15).max(axis=(1, 2))


@pytest.fixture(scope="module")
def several(views) -> list[Surfels]:
    """With other seeds: what single surfels at a border do is chance."""
    return [initialise_surfels(views, COUNT, seed=seed) for seed in range(6)]


def test_edges_stop_surfels_at_the_border(views, several):
    spacing = float(several[0].coverage.clip_softness) / 0.12
    clipped = [overhang(surfels) for surfels in several]
    whole = overhang(initialise_surfels(views, COUNT, seed=0, clips=False))
    assert whole.max() > 0.5 * spacing  # measured 0.53
    assert np.mean([one.max() for one in clipped]) < 0.4 * spacing  # measured 0.25
    assert np.mean([np.percentile(one, 95) for one in clipped]) < 0.1 * spacing  # measured 0.061


def test_surfels_inside_a_surface_have_no_edge(surfels):
    center = surfels.centers
    floor = (center[:, 2] + 0.5).abs() < 1e-4
    spacing = surfels.coverage.clip_softness / 0.12
    away = (np.abs(BLOCK.local(center.double().numpy()))[:, :2].max(axis=1) > 0.15 + 1.5 * spacing) & (
        center[:, :2].abs().amax(dim=1) < 0.5 - 1.5 * spacing
    ).numpy()
    inner = surfels.clip_offsets[floor.numpy() & away, 0]
    assert len(inner) > 50
    assert (inner == NO_CLIP).float().mean() > 0.98


def test_two_edges_meet_at_a_corner(several):
    """The mean over six seeds: a surfel may be nearer to one edge of the corner than to the corner."""
    assert np.mean([_turned_at_the_corner(surfels) for surfels in several]) < 0.4  # measured 0.26


def _turned_at_the_corner(surfels: Surfels) -> float:
    """The cosine between the two edges of the surfel that is nearest to a corner of the block."""
    corner = BLOCK.axes.T @ np.array([0.15, 0.15, 0.2]) + np.array(BLOCK.center)
    top = (surfels.normals[:, 2] > 0.99) & ((surfels.centers[:, 2] + 0.1).abs() < 1e-4)
    index = torch.where(top)[0][(surfels.centers[top] - torch.from_numpy(corner)).norm(dim=1).argmin()]
    assert (surfels.clip_offsets[index] < NO_CLIP).all()
    angle = surfels.clip_angles[index]
    directions = torch.stack([angle.cos(), angle.sin()], dim=-1) @ surfels.frames[index, :2]
    return abs(float(directions[0] @ directions[1]))


def test_same_seed_same_surfels(views, surfels):
    again = initialise_surfels(views, COUNT, seed=0)
    other = initialise_surfels(views, COUNT, seed=1)
    for name, tensor in surfels.tensors().items():
        assert torch.equal(tensor, getattr(again, name)), name
    assert again.coverage == surfels.coverage
    assert not torch.equal(other.centers, surfels.centers)


def test_normal_pass_is_used_where_there_is_one(views):
    with_pass = room_views(2, normals=True)
    turned = [replace(view, normal=-view.normal) for view in with_pass]
    assert degrees_off(cloud_from_views(with_pass, COUNT, normals="pass").normals).max() < 0.05
    # Normals that face away are refused as grazing, which shows that "auto" took the pass.
    with pytest.raises(InputError, match="no pixel"):
        cloud_from_views(turned, COUNT, normals="auto")
    assert len(cloud_from_views(turned, COUNT, normals="estimate"))
    with pytest.raises(InputError, match=r"train/r_0000.*normal pass"):
        cloud_from_views(views, COUNT, normals="pass")


def test_a_sphere_seen_beside_a_plane_stays():
    """Curved surfaces deviate from planes, but smoothly: they are not taken for edges."""
    size, focal = 64, 80.0
    pixel = (np.arange(size) + 0.5 - 0.5 * size) / focal
    x, y = np.meshgrid(pixel, -pixel)
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1)
    center, radius = np.array([0.0, 0.0, -2.0]), 0.4
    along, square = rays @ center, (rays**2).sum(-1)
    root = along**2 - square * (center @ center - radius**2)
    ball = root > 0
    depth = np.where(ball, (along - np.sqrt(np.maximum(root, 0.0))) / square, 3.0)
    fits = normals_from_depth(depth, (focal, focal), (size / 2, size / 2))
    found, valid = fits.normals, fits.valid
    true = (rays * depth[..., None] - center) / radius
    inner = np.linalg.norm(true[..., :2], axis=-1) < 0.7  # beyond it a silhouette's windows reach the background
    assert valid[ball & inner].all()
    error = np.degrees(np.arccos(np.clip((found * true).sum(-1)[ball & inner], -1, 1)))
    assert error.mean() < 3.0  # measured 1.4


@pytest.mark.parametrize("noise", [0.001, 0.01, 0.05])
def test_noise_is_survived(views, noise):
    rng = torch.Generator().manual_seed(0)
    noisy = [
        replace(view, depth=view.depth * (1 + noise * torch.randn(view.depth.shape, generator=rng))) for view in views
    ]
    surfels = initialise_surfels(noisy, 500, seed=0)
    assert len(surfels) == 500
    assert all(tensor.isfinite().all() for tensor in surfels.tensors().values())


def test_an_object_in_empty_space():
    box = Cuboid((0.0, 0.0, 0.0), (0.4, 0.4, 0.4))
    eyes = [(1.2, 0.5, 0.8), (-1.2, 0.6, 0.7), (0.4, -1.3, 0.6), (-0.3, 1.3, 0.9)]
    surfels = initialise_surfels([view_of([box], eye, (0.0, 0.0, 0.0), angle=0.6) for eye in eyes], 300, seed=0)
    assert surface_distance(surfels.centers.double().numpy(), (box,)).max() < 1e-5
    assert (surfels.centers[:, 2] > -0.21).all()


def test_no_depth_is_an_error_that_says_what_would_help(views):
    bare = [replace(view, depth=None) for view in views]
    with pytest.raises(InputError, match=r"^data/mine: .*24 views \(train/r_0000, .*depth_path.*Blender renders"):
        initialise_surfels(bare, COUNT, seed=0, where="data/mine")


def test_views_without_depth_are_passed_over(views):
    mixed = [views[0], *(replace(view, depth=None) for view in views[1:])]
    assert len(cloud_from_views(mixed, COUNT)) == len(cloud_from_views(views[:1], COUNT))


def test_depth_that_shows_nothing_is_an_error(views):
    empty = [replace(view, depth=torch.full_like(view.depth, torch.inf)) for view in views[:2]]
    with pytest.raises(InputError, match="no pixel of 2 depth maps"):
        initialise_surfels(empty, COUNT, seed=0)


@pytest.mark.parametrize("value", [-float("inf"), 0.0, -1.0])
def test_impossible_depth_names_view_and_pixel(views, value):
    depth = views[1].depth.clone()
    depth[3, 5] = value
    with pytest.raises(InputError, match=r"train/r_0001.*1 pixels.*row 3, column 5"):
        initialise_surfels([views[0], replace(views[1], depth=depth)], COUNT, seed=0)


def test_too_few_points_say_how_many_there_are(views):
    with pytest.raises(InputError, match=r"at least 100000.*found \d+ in 2 views.*at most \d+ surfels .surfels=…."):
        initialise_surfels(views[:2], 100_000, seed=0)
    with pytest.raises(ValueError, match="at least 1"):
        initialise_surfels(views[:2], 0, seed=0)
