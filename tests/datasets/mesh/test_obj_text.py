"""OBJ files as programs write them: points counted backwards, lines that begin with blanks, old ends of lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mesh_files import QUARTERS, painted, quarters, textured_square
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.errors import InputError
from rgspipe.scene import srgb

#: Two triangles, the second above the first.
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5], [1, 0, 5], [0, 1, 5]], float)
LOWER, UPPER = ("\n".join("v {:g} {:g} {:g}".format(*point) for point in part) for part in (POINTS[:3], POINTS[3:]))

WRITTEN = {
    "counted from the first": f"{LOWER}\n{UPPER}\nf 1 2 3\nf 4 5 6\n",
    "counted backwards": f"{LOWER}\nf -3 -2 -1\n{UPPER}\nf -3 -2 -1\n",
    "counted both ways": f"{LOWER}\n{UPPER}\nf 1 2 3\nf 4 -2 -1\n",
    "with blanks before": f"  {LOWER}\n \t{UPPER}\n  f 1 2 3\n\tf 4 5 6\n",
    "with tabs": f"{LOWER}\n{UPPER}\nf 1 2 3\nf 4 5 6\n".replace(" ", "\t"),
    "with carriage returns": f"{LOWER}\n{UPPER}\nf 1 2 3\nf 4 5 6\n".replace("\n", "\r"),
    "with a mark of its encoding": f"\ufeff{LOWER}\n{UPPER}\nf 1 2 3\nf 4 5 6\n",
    "with lines that go on": f"{LOWER}\n{UPPER}\nf 1 \\\n2 3\nf 4 5 \\\r\n6\n",
}


@pytest.mark.parametrize("how", WRITTEN)
def test_the_same_triangles_are_read_however_they_are_written(tmp_path: Path, how: str) -> None:
    (tmp_path / "a.obj").write_text(WRITTEN[how])
    mesh = read_mesh(tmp_path / "a.obj")
    found = sorted(mesh.vertices[mesh.faces].tolist())
    assert found == sorted([POINTS[:3].tolist(), POINTS[3:].tolist()])


@pytest.mark.parametrize("face", ["0 2 3", "1 2 0", "1/0 2/1 3/1", "-4 1 2", "1 2 -9"])
def test_points_that_are_not_there_are_refused(tmp_path: Path, face: str) -> None:
    (tmp_path / "a.obj").write_text(f"{LOWER}\nvt 0 0\nf {face}\n")
    with pytest.raises(InputError, match=r"a\.obj: expected faces of points that are there, counted from 1"):
        read_mesh(tmp_path / "a.obj")


def test_texture_is_where_it_belongs_if_its_places_are_counted_backwards(tmp_path: Path) -> None:
    textured_square(quarters()).export(tmp_path / "a.obj")
    text = (tmp_path / "a.obj").read_text().replace("f 1/1 2/2 3/3", "f -4/-4 -3/-3 -2/-2")
    assert "/-4" in text
    (tmp_path / "a.obj").write_text(text)
    assert np.array_equal(painted(tmp_path / "a.obj"), QUARTERS)


def test_names_of_materials_may_be_in_an_old_encoding(tmp_path: Path) -> None:
    textured_square(quarters()).export(tmp_path / "a.obj")
    for path in (tmp_path / "a.obj", tmp_path / "material.mtl"):
        path.write_bytes(path.read_bytes().replace(b" material_0\n", b" H\xf6lz\n"))
    assert np.array_equal(painted(tmp_path / "a.obj"), QUARTERS)


@pytest.mark.parametrize("values", ["128 0 0", "0.5 -0.1 0", "0.5 nan 0", "1.0 0.5 0.5 0.5", "0.5 0.5", "1 2 3 4 5"])
def test_colours_of_points_that_are_no_three_shares_are_refused(tmp_path: Path, values: str) -> None:
    """Levels up to 255 all became 1, and of a weight and a colour the weight was taken for red."""
    (tmp_path / "a.obj").write_text("".join(f"v {x} {y} 0 {values}\n" for x, y in POINTS[:3, :2]) + "f 1 2 3\n")
    with pytest.raises(InputError, match=r"a\.obj: expected points x y z, or x y z r g b with colours from 0 to 1"):
        read_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("values", ["0.2 0.4 1.0", "0.2 0.4 1 # of a scan"])
def test_colours_of_points_are_shares(tmp_path: Path, values: str) -> None:
    (tmp_path / "a.obj").write_text("".join(f"v {x} {y} 0 {values}\n" for x, y in POINTS[:3, :2]) + "f 1 2 3\n")
    # Off by nothing: these are bytes.
    found = read_mesh(tmp_path / "a.obj").paint.corners
    np.testing.assert_allclose(found, np.broadcast_to(srgb.decode(np.array([0.2, 0.4, 1.0])), (1, 3, 3)), atol=1e-12)
