"""PLY files whose faces have more corners than three, with colours and places in a texture."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from mesh_files import QUARTERS, quarters
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.errors import InputError
from rgspipe.scene import srgb
from rgspipe.scene.mesh import TriangleMesh

#: A wall of 5.5 with a doorway, as one polygon; and two squares beside each other.
WALL = [(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (3, 0), (3, 2.5), (0, 2.5)]
SQUARES, QUADS = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 1)], [(0, 1, 2, 3), (1, 4, 5, 2)]
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

Rows = list[tuple[float, ...]]


def write(
    path: Path, kind: str, points: Rows, faces: Rows, point_colours: Rows = (), colours: Rows = (), places: Rows = ()
) -> Path:
    """Points (x, z), with colours of points or of faces, or with the places of each face's corners in `t.png`."""
    paint = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    head = f"ply\nformat {kind} 1.0\n{'comment TextureFile t.png' * bool(places)}\nelement vertex {len(points)}\n"
    head += "".join(f"property float {name}\n" for name in "xyz") + paint * bool(point_colours)
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n" + paint * bool(colours)
    head += "property list uchar float texcoord\n" * bool(places) + "end_header\n"
    rows = [([x, 0, z, *(point_colours[n] if point_colours else ())], "3f3B") for n, (x, z) in enumerate(points)]
    for number, face in enumerate(faces):
        row = [len(face), *face, *(colours[number] if colours else ())]
        row += [len(places[number]), *places[number]] if places else []
        rows.append((row, f"B{len(face)}i" + "3B" * bool(colours) + (f"B{2 * len(face)}f" if places else "")))
    if kind == "ascii":
        path.write_text(head.replace("\n\n", "\n") + "".join(" ".join(map(str, row)) + "\n" for row, _ in rows))
        return path
    packed = (
        struct.pack(FORMATS[kind] + (form if len(row) > 3 or form[0] == "B" else "3f"), *row) for row, form in rows
    )
    path.write_bytes(head.replace("\n\n", "\n").encode() + b"".join(packed))
    return path


def middles(mesh: TriangleMesh) -> np.ndarray:
    return mesh.paint.at(np.arange(len(mesh)), np.full((len(mesh), 3), 1.0 / 3.0))


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("first", [0, 3, 5])
def test_a_doorway_stays_open(tmp_path: Path, kind: str, first: int) -> None:
    """A fan closed it twice, with an area of up to 11.5."""
    face = tuple((first + step) % 8 for step in range(8))
    levels = [(20 * number, 100, 200) for number in range(8)]
    mesh = read_mesh(write(tmp_path / "a.ply", kind, WALL, [face], point_colours=levels))
    # Off by nothing.
    assert abs(mesh.areas.sum() - 5.5) < 1e-12
    nearest = [WALL.index((x, z)) for x, _, z in mesh.vertices[mesh.faces].reshape(-1, 3)]
    expected = srgb.decode(np.array(levels)[nearest] / 255.0).reshape(-1, 3, 3)
    # Off by nothing.
    np.testing.assert_allclose(mesh.paint.corners, expected, atol=1e-12)


@pytest.mark.parametrize("kind", FORMATS)
def test_colours_of_faces_are_those_of_their_triangles(tmp_path: Path, kind: str) -> None:
    """There was a bare IndexError of numpy."""
    path = write(tmp_path / "a.ply", kind, SQUARES, QUADS, colours=[(255, 0, 0), (0, 0, 255)])
    mesh = read_mesh(path)
    right = mesh.points(np.arange(4), np.full((4, 3), 1.0 / 3.0))[:, 0] > 1.0
    np.testing.assert_array_equal(middles(mesh), np.where(right[:, None], [0, 0, 1], [1, 0, 0]))


def test_polygons_of_several_sizes_in_text(tmp_path: Path) -> None:
    faces = [(1, 4, 5), (0, 1, 2, 3)]
    mesh = read_mesh(write(tmp_path / "a.ply", "ascii", SQUARES, faces, colours=[(255, 0, 0), (0, 0, 255)]))
    np.testing.assert_array_equal(middles(mesh), [[1, 0, 0], [0, 0, 1], [0, 0, 1]])


@pytest.mark.parametrize("kind", ["binary_little_endian", "binary_big_endian"])
def test_places_in_a_texture_go_with_the_corners_of_a_polygon(tmp_path: Path, kind: str) -> None:
    quarters().save(tmp_path / "t.png")
    places = [tuple(value for x, z in WALL for value in (x / 3, z / 2.5))]
    mesh = read_mesh(write(tmp_path / "a.ply", kind, WALL, [tuple(range(8))], places=places))
    assert abs(mesh.areas.sum() - 5.5) < 1e-12
    expected = mesh.vertices[mesh.faces][..., [0, 2]] / [3.0, 2.5]
    # Off by 2e-8: places are float32.
    np.testing.assert_allclose(mesh.paint.uv, expected, atol=1e-6)
    # Off by 1.8e-6.
    corner = mesh.paint.at(np.array([0]), np.array([[0.98, 0.01, 0.01]]))
    assert np.abs(255.0 * srgb.encode(corner) - QUARTERS).max(axis=1).min() < 1e-3


@pytest.mark.parametrize("kind", FORMATS)
def test_a_polygon_that_crosses_itself_is_refused(tmp_path: Path, kind: str) -> None:
    path = write(tmp_path / "a.ply", kind, SQUARES, [(0, 1, 2, 3), (0, 2, 1, 3)])
    with pytest.raises(InputError, match=r"a\.ply: face 1: .*Triangulate the faces when you export it"):
        read_mesh(path)


def test_binary_lists_that_differ_in_length_but_not_together_are_refused(tmp_path: Path) -> None:
    """Three faces of 4, 3 and 5 corners take the bytes of three with 4, and were read as such."""
    points = [*SQUARES, (3, 0), (3, 1)]
    path = write(tmp_path / "a.ply", "binary_little_endian", points, [(0, 1, 2, 3), (1, 4, 5), (1, 4, 6, 7, 5)])
    with pytest.raises(InputError, match=r"a\.ply.*Triangulate the faces when you export it"):
        read_mesh(path)


def test_strips_of_triangles_are_refused(tmp_path: Path) -> None:
    """They were left out."""
    path = write(tmp_path / "a.ply", "ascii", SQUARES, [(0, 1, 2)])
    text = path.read_text().replace(
        "end_header", "element tristrips 1\nproperty list int int vertex_indices\nend_header"
    )
    path.write_text(text + "4 0 2 3 5\n")
    with pytest.raises(InputError, match=r"a\.ply: element tristrips: expected faces, found strips of triangles"):
        read_mesh(path)
