"""Poses and meshes written by other conventions, told by what photographs show of the mesh."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch

from lit_room import BOX_CENTER, BOX_SIZE
from mesh_files import boxes_mesh
from photographed_room import LAMPS, photographs
from raycast import ROOM, Cuboid
from rgspipe.datasets.mesh.up import UPRIGHT
from rgspipe.datasets.views import View
from rgspipe.evidence.mesh_poses import MeshReading, poses_on_mesh
from rgspipe.evidence.readings import FLIP

MESH = boxes_mesh(ROOM, Cuboid(BOX_CENTER, (BOX_SIZE,) * 3))


@cache
def views() -> list[View]:
    """Each exposed by itself."""
    taken = photographs(LAMPS[:1], count=12, resolution=32)
    return [replace(view, image=2.0 ** (index % 3) * view.image) for index, view in enumerate(taken)]


def moved(change: object) -> list[View]:
    def camera_of(view: View) -> View:
        pose = torch.from_numpy(np.ascontiguousarray(change(view.camera.camera_to_world.double().numpy())))
        return replace(view, camera=replace(view.camera, camera_to_world=pose))

    return [camera_of(view) for view in views()]


def test_right_poses_are_left_alone() -> None:
    finding = poses_on_mesh(views(), MESH, y_up=False)
    # Measured: 0.93; of the others none has more than 0.42.
    assert finding.clear and not finding.misread and finding.stated > 0.9


@pytest.mark.parametrize(
    ("taken", "mesh", "meant"),
    [
        (lambda: moved(lambda m: m @ FLIP), MESH, MeshReading(opencv=True)),
        (lambda: moved(np.linalg.inv), MESH, MeshReading(inverse=True)),
        (views, MESH.moved(np.diag([1e3, 1e3, 1e3, 1.0])), MeshReading(scale=1e-3)),
        (views, MESH.moved(UPRIGHT.T), MeshReading(turned=True)),
        (lambda: moved(lambda m: m @ FLIP), MESH.moved(UPRIGHT.T), MeshReading(opencv=True, turned=True)),
    ],
    ids=["opencv", "inverse", "millimetres", "y up", "opencv, y up"],
)
def test_mistakes_are_told(taken: object, mesh: object, meant: MeshReading) -> None:
    finding = poses_on_mesh(taken(), mesh, y_up=False)
    assert finding.misread and finding.meant == meant, finding


def test_poses_of_other_photographs_are_not_clear_about_anything() -> None:
    poses = [view.camera for view in views()]
    shuffled = [replace(view, camera=poses[(i + 5) % len(poses)]) for i, view in enumerate(views())]
    assert not poses_on_mesh(shuffled, MESH, y_up=False).clear
