"""Materials and textures of OBJ files, as programs write them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from mesh_files import QUARTERS, painted, quarters, textured_square
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.datasets.mesh.links import mesh_files
from rgspipe.errors import InputError

#: The line of a material's texture t.png, the name that it has, and the line of its library a.mtl.
READ_RIGHT: dict[str, tuple[str, str, str]] = {
    "percent sign": ("map_Kd a%20b.png", "a%20b.png", "mtllib a.mtl"),
    "options that change nothing": (
        "map_Kd -s 1 1 1 -o 0 0 -blendu on -mm 0 1 -clamp off t.png",
        "t.png",
        "mtllib a.mtl",
    ),
    "quotes": ('map_Kd "my t.png"', "my t.png", 'mtllib "a.mtl"'),
    "spaces": ("map_Kd -s 1 1 1 my  t.png", "my  t.png", "mtllib a.mtl"),
    "backslashes": ("map_Kd parts\\t.png", "parts/t.png", "mtllib .\\a.mtl"),
    "two libraries": ("map_Kd t.png", "t.png", "mtllib other.mtl a.mtl"),
    "two lines of libraries": ("map_Kd t.png", "t.png", "mtllib other.mtl\nmtllib a.mtl"),
    "a line that goes on": ("map_Kd \\\nt.png", "t.png", "mtllib \\\na.mtl"),
    "a number for a name": ("map_Kd -s 1 1 7.png", "7.png", "mtllib a.mtl"),
    "no colour in a comment": ("# map_Kd none.png\nmap_Kd t.png", "t.png", "# mtllib none.mtl\nmtllib a.mtl"),
}


def write_square(folder: Path, texture: str, name: str, library: str) -> Path:
    """A textured square as OBJ, with these lines for the library and for the texture, whose file has this name."""
    textured_square(quarters()).export(folder / "a.obj")
    for path in [*folder.glob("*.mtl"), *folder.glob("*.png")]:
        path.unlink()
    (folder / name).parent.mkdir(exist_ok=True)
    quarters().save(folder / name, format="PNG")
    lines = (folder / "a.obj").read_text().splitlines()
    (used,) = {line for line in lines if line.startswith("usemtl")}
    (folder / "a.obj").write_text("\n".join(library if line.startswith("mtllib") else line for line in lines))
    (folder / "other.mtl").write_text("newmtl other\nKd 1 0 0\n")
    (folder / "a.mtl").write_text(f"newmtl {used.split()[1]}\nKd 0.5 0.5 0.5\n{texture}\n")
    return folder / "a.obj"


@pytest.mark.parametrize("case", READ_RIGHT)
def test_textures_of_an_obj_are_found_however_they_are_named(tmp_path: Path, case: str) -> None:
    path = write_square(tmp_path, *READ_RIGHT[case])
    assert np.array_equal(painted(path), QUARTERS)
    assert tmp_path / READ_RIGHT[case][1] in mesh_files(path) and tmp_path / "a.mtl" in mesh_files(path)


@pytest.mark.parametrize(
    ("texture", "library", "words"),
    [
        ("map_Kd -s 2 2 1 t.png", "mtllib a.mtl", "a.mtl: expected textures as they are stored, found -s 2"),
        ("map_Kd -o 0.5 t.png", "mtllib a.mtl", "found -o 0.5"),
        ("map_Kd -clamp on t.png", "mtllib a.mtl", "found -clamp on"),
        ("map_Kd none.png", "mtllib a.mtl", "none.png: expected a file that a.obj names, found no such file"),
        ("map_Kd t.png", "mtllib none.mtl", "none.mtl: expected a file that a.obj names, found no such file"),
        ("map_Kd ../t.png", "mtllib a.mtl", "a.mtl: expected names of files in the folder of the mesh or below"),
        ("map_Kd /etc/passwd", "mtllib a.mtl", "found '/etc/passwd'"),
        ("map_Kd t.png", "mtllib ../a.mtl", "a.obj: expected names of files in the folder of the mesh or below"),
        ("Kd 0.5 nan 0.5", "mtllib a.mtl", "expected three numbers from 0 to 1 as Kd"),
    ],
)
def test_what_an_obj_names_and_is_not_read_is_said(tmp_path: Path, texture: str, library: str, words: str) -> None:
    path = write_square(tmp_path, texture, "t.png", library)
    with pytest.raises(InputError, match=re.escape(words)):
        read_mesh(path)


def test_a_mark_of_encoding_hides_no_material(tmp_path: Path) -> None:
    path = write_square(tmp_path, "", "t.png", "mtllib a.mtl")
    (tmp_path / "a.mtl").write_text("\ufeff" + (tmp_path / "a.mtl").read_text())
    assert (read_mesh(path).paint.corners == 0.5).all()


def test_a_material_without_a_colour_has_none(tmp_path: Path) -> None:
    assert np.isnan(read_mesh(write_square(tmp_path, "illum 1", "t.png", "mtllib a.mtl")).paint.corners).sum() == 0
    (tmp_path / "a.mtl").write_text((tmp_path / "a.mtl").read_text().replace("Kd", "#"))
    assert np.isnan(read_mesh(tmp_path / "a.obj").paint.corners).all(), "and not the grey that the decoder invents"


@pytest.mark.parametrize("texture", ["map_Kd t.png", ""])
def test_metal_of_an_obj_reflects_nothing_diffusely(tmp_path: Path, texture: str) -> None:
    """As Blender writes it; it was taken for paint of its colour."""
    path = write_square(tmp_path, f"{texture}\nPm 0.75", "t.png", "mtllib a.mtl")
    mesh = read_mesh(path)
    factor = mesh.paint.corners if texture else mesh.paint.corners / 0.5
    np.testing.assert_allclose(factor, 0.25)
    assert mesh.remarks == ()


def test_pictures_of_metal_of_an_obj_are_said_to_be_left_out(tmp_path: Path) -> None:
    (remark,) = read_mesh(write_square(tmp_path, "map_Pm metal.png", "t.png", "mtllib a.mtl")).remarks
    assert "map_Pm" in remark


def test_a_share_of_metal_that_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.mtl: expected a number from 0 to 1 as Pm, found “Pm 2”"):
        read_mesh(write_square(tmp_path, "Pm 2", "t.png", "mtllib a.mtl"))


@pytest.mark.parametrize(
    ("line", "said"), [("d 0.3", True), ("d -halo 0.3", True), ("map_d a.png", True), ("d 1.0", False)]
)
def test_it_is_said_of_an_obj_that_what_one_sees_through_is_opaque(tmp_path: Path, line: str, said: bool) -> None:
    """It was said of glTF alone."""
    remarks = read_mesh(write_square(tmp_path, f"map_Kd t.png\n{line}", "t.png", "mtllib a.mtl")).remarks
    assert ["see through" in remark for remark in remarks] == [True] * said
