"""Faces of OBJ files: polygons that are not convex, and such with and without places in a texture in one file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mesh_files import QUARTERS, quarters
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.errors import InputError
from rgspipe.scene import srgb
from rgspipe.scene.mesh import TriangleMesh

#: A wall of 5.5 with a doorway, as one polygon.
WALL = [(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (3, 0), (3, 2.5), (0, 2.5)]

#: Two triangles of a square, whose places are red; and what stands before.
HEAD = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0.1 0.9\nvt 0.2 0.9\nvt 0.2 0.8\nusemtl m\n"
RED, BLUE = srgb.decode(QUARTERS[0] / 255.0), np.array([0.1, 0.2, 0.6])


def read(folder: Path, text: str) -> TriangleMesh:
    quarters().save(folder / "t.png")
    (folder / "a.mtl").write_text("newmtl m\nKd 0.1 0.2 0.6\nmap_Kd t.png\n")
    (folder / "a.obj").write_text(text)
    return read_mesh(folder / "a.obj")


def middles(mesh: TriangleMesh) -> np.ndarray:
    return mesh.paint.at(np.arange(len(mesh)), np.full((len(mesh), 3), 1.0 / 3.0))


def walled(first: int, corner: str) -> str:
    points = "".join(f"v {x} 0 {z}\n" for x, z in WALL)
    order = [(first + step) % len(WALL) + 1 for step in range(len(WALL))]
    return points + "f " + " ".join(corner.format(one) for one in order) + "\n"


@pytest.mark.parametrize("corner", ["{}", "{0}//1", "{0}/{0}", "{0}/{0}/1"])
@pytest.mark.parametrize("first", range(8))
def test_a_doorway_stays_open(tmp_path: Path, first: int, corner: str) -> None:
    """A fan closed it twice, with an area of up to 11.5."""
    places = "".join(f"vt {x} {z}\n" for x, z in WALL)
    mesh = read(tmp_path, f"vn 0 1 0\n{places}{walled(first, corner)}")
    # Off by nothing.
    assert abs(mesh.areas.sum() - 5.5) < 1e-12
    centres = mesh.points(np.arange(len(mesh)), np.full((len(mesh), 3), 1.0 / 3.0))
    x, z = centres[:, 0], centres[:, 2]
    assert not ((x > 1) & (x < 2) & (z < 2)).any()


def test_places_in_a_texture_go_with_the_corners_of_a_polygon(tmp_path: Path) -> None:
    places = "".join(f"vt {x / 3} {z / 2.5}\n" for x, z in WALL)
    mesh = read(tmp_path, f"mtllib a.mtl\n{places}usemtl m\n{walled(3, '{0}/{0}')}")
    expected = mesh.vertices[mesh.faces][..., [0, 2]] / [3.0, 2.5]
    # Off by nothing.
    np.testing.assert_allclose(mesh.paint.uv, expected, atol=1e-12)
    assert set(mesh.paint.texture) == {0}


def test_a_polygon_that_crosses_itself_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.obj: face 1: .*Triangulate the faces when you export it"):
        read(tmp_path, "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3 4\n")


@pytest.mark.parametrize(
    ("textured", "plain"),
    [("1/1/1 2/2/1 3/3/1", "1//1 3//1 4//1"), ("1/1 2/2 3/3", "1//1 3//1 4//1"), ("1/1 2/2 3/3", "1 3 4"),
     ("1/1/1 2/2/1 3/3/1", "1 3 4"), ("1/1/ 2/2/ 3/3/", "1// 3// 4//"), ("1/1 2/2 3/3", "1 3/1 4")],
)  # fmt: skip
@pytest.mark.parametrize("between", ["", "g b\n", "o b\nusemtl m\n"])
def test_faces_without_places_take_the_texture_from_no_others(
    tmp_path: Path, textured: str, plain: str, between: str
) -> None:
    """All of a material were without it."""
    for order in ((textured, plain), (plain, textured)):
        mesh = read(tmp_path, f"{HEAD}g a\nf {order[0]}\n{between}f {order[1]}\n")
        lower = mesh.points(np.arange(2), np.full((2, 3), 1.0 / 3.0))[:, 1] < 0.5
        # Off by 1.2e-8: textures are float32.
        np.testing.assert_allclose(middles(mesh), np.where(lower[:, None], RED, BLUE), atol=1e-7)


def test_faces_with_and_without_normals_are_one_material(tmp_path: Path) -> None:
    mesh = read(tmp_path, f"{HEAD}f 1/1 2/2 3/3\nf 1/1/1 3/2/1 4/3/1\n")
    np.testing.assert_allclose(middles(mesh), [RED, RED], atol=1e-7)


def test_a_hexagon_beside_a_triangle_with_places_is_whole(tmp_path: Path) -> None:
    """Both have six numbers: half of the hexagon was missing."""
    angles = np.arange(6) * np.pi / 3.0
    points = "".join(f"v {np.cos(angle)} {np.sin(angle)} 0\n" for angle in angles)
    mesh = read(tmp_path, f"{points}vt 0.1 0.9\nvt 0.2 0.9\nvt 0.2 0.8\nf 1/1 2/2 3/3\nf 1 3 4 5 6 1\n")
    # Off by nothing.
    assert abs(mesh.areas.sum() - 3.0 * np.sin(np.pi / 3.0)) < 1e-12


def test_a_comment_beside_a_face_is_no_corner(tmp_path: Path) -> None:
    assert len(read(tmp_path, f"{HEAD}f 1 2 3 # lower 4\nf 1 3 4\n")) == 2


def test_places_in_no_texture_are_no_grey(tmp_path: Path) -> None:
    assert not read(tmp_path, f"{HEAD.replace('usemtl m', '')}f 1/1 2/2 3/3\n").paint.known


def test_a_colour_is_not_rounded_to_bytes(tmp_path: Path) -> None:
    (tmp_path / "b.mtl").write_text("newmtl m\nKd 0.5 0.0015 0.1\n")
    mesh = read(tmp_path, f"{HEAD.replace('a.mtl', 'b.mtl')}f 1 2 3\n")
    np.testing.assert_array_equal(mesh.paint.corners[0, 0], [0.5, 0.0015, 0.1])
