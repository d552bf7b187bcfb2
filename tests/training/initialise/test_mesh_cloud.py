"""Points on the sides of triangles that air touches, however these are wound."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mesh_files import boxes_mesh, cuboid_triangles, unpainted
from raycast import BLOCK, ROOM, Cuboid, surface_distance
from rgspipe.scene.mesh import TriangleMesh
from rgspipe.training.initialise import surfels_on
from rgspipe.training.initialise.mesh_cloud import cloud_from_mesh

EYES = np.array([[0.3, -0.3, 0.2], [-0.35, 0.3, 0.3]])


def wound_by_chance(mesh: TriangleMesh, seed: int = 0) -> TriangleMesh:
    turned = np.random.default_rng(seed).random(len(mesh)) < 0.5
    return unpainted(mesh.vertices, np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))


@pytest.mark.parametrize("count", [100, 400])
def test_normals_face_the_air_and_density_is_even(count: int) -> None:
    cloud = cloud_from_mesh(wound_by_chance(boxes_mesh(ROOM, BLOCK)), EYES, count)
    assert surface_distance(cloud.points).max() < 1e-7
    # A step along the normal goes into the room, and out of the block.
    ahead = cloud.points + 1e-3 * cloud.normals
    assert (np.abs(ROOM.local(ahead)) < 0.5).all()
    assert not (np.abs(BLOCK.local(ahead)) < 0.5 * np.array(BLOCK.size)).all(axis=1).any()
    # Of the room's six sides none has more: the block covers a part of the floor, and has 0.48 of its own.
    walls = np.abs(cloud.points[:, 0]) > 0.4999
    left, right = (cloud.points[walls, 0] < 0).sum(), (cloud.points[walls, 0] > 0).sum()
    assert abs(left / right - 1.0) < 0.01
    ceiling = (cloud.points[:, 2] > 0.4999).sum()
    assert abs(left / ceiling - 1.0) < 0.01


def test_the_inside_of_closed_bodies_gets_no_points() -> None:
    hollow = Cuboid((-0.1, 0.1, -0.3), (0.1, 0.1, 0.1), turn=0.3)
    cloud = cloud_from_mesh(boxes_mesh(ROOM, BLOCK, hollow), EYES, 200)
    assert surface_distance(cloud.points).max() < 1e-7


def test_a_sheet_between_two_halves_gets_both_sides_where_air_reaches_both() -> None:
    sheet = np.array([[-0.5, 0.0, -0.5], [0.5, 0.0, -0.5], [0.5, 0.0, 0.2], [-0.5, 0.0, 0.2]])
    points, faces = cuboid_triangles(ROOM)
    mesh = unpainted(np.concatenate([points, sheet]), np.concatenate([faces, [[24, 25, 26], [24, 26, 27]]]))
    # The only camera is in front; light comes over the top.
    cloud = cloud_from_mesh(mesh, np.array([[0.0, -0.3, 0.0]]), 300)
    on = np.abs(cloud.points[:, 1]) < 1e-9
    front, back = (cloud.normals[on, 1] < -0.9).sum(), (cloud.normals[on, 1] > 0.9).sum()
    assert front > 500 and abs(back / front - 1.0) < 0.02
    assert (cloud.points[:, 1] > 0.4999).sum() > 500, "the far wall"


def test_nooks_are_reached() -> None:
    """Under a shelf a hand above the floor, of which no camera sees anything."""
    shelf = Cuboid((0.0, 0.0, -0.44), (0.8, 0.8, 0.04))
    cloud = cloud_from_mesh(boxes_mesh(ROOM, shelf), np.array([[0.0, 0.0, 0.3]]), 500)
    under = (np.abs(cloud.points[:, :2]) < 0.4).all(axis=1) & (cloud.points[:, 2] < -0.4599)
    floor, bottom = (cloud.normals[under, 2] > 0.9).sum(), (cloud.normals[under, 2] < -0.9).sum()
    # Of 0.64 of the area each, against one side of the room; measured 0.998 and 0.999 of that.
    side = (cloud.points[:, 0] > 0.4999).sum()
    assert min(floor, bottom) > 0.97 * 0.64 * side


def test_surfels_stand_on_the_mesh() -> None:
    cloud = cloud_from_mesh(boxes_mesh(ROOM, BLOCK), EYES, 400)
    surfels = surfels_on(cloud, 400, seed=0)
    assert len(surfels) == 400
    away = surface_distance(surfels.centers.double().numpy())
    assert np.quantile(away, 0.95) < 1e-3  # measured 2e-4
    inwards = surfels.centers.double() + 0.01 * surfels.normals.double()
    assert bool((inwards.abs() < 0.5 + 1e-6).all(dim=1).float().mean() > 0.99)
    assert torch.isfinite(surfels.scales).all()
