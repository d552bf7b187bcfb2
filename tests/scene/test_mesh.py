"""Areas and normals of triangles."""

from __future__ import annotations

import numpy as np

from mesh_files import boxes_mesh, unpainted
from raycast import ROOM


def test_areas_and_normals_are_those_of_a_cube() -> None:
    mesh = boxes_mesh(ROOM)
    assert np.allclose(mesh.areas, 0.5) and mesh.size == np.sqrt(3.0)
    assert np.allclose(np.abs(mesh.normals).max(axis=1), 1.0)


def test_a_triangle_without_area_has_no_normal() -> None:
    mesh = unpainted(np.eye(3), np.array([[0, 1, 2], [0, 0, 1]]))
    assert mesh.areas.tolist() == [np.sqrt(3.0) / 2.0, 0.0]
    assert np.allclose(mesh.normals, [np.full(3, 3**-0.5), np.zeros(3)])
