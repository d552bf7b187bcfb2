"""Meshes that the tests write: PLY, OBJ, GLB and glTF, with colours at their points and in textures."""

from __future__ import annotations

import json
import os
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mesh_files import cuboid_triangles, quarters, textured_square, write_coloured
from raycast import BLOCK
from rgspipe.datasets.mesh.file import OwnFiles, read_mesh
from rgspipe.datasets.mesh.links import mesh_files
from rgspipe.datasets.mesh.options import MeshOptions
from rgspipe.datasets.mesh.up import UPRIGHT
from rgspipe.errors import InputError
from rgspipe.scene import srgb
from rgspipe.scene.mesh import TriangleMesh

VERTICES, FACES = cuboid_triangles(BLOCK)
LEVELS = np.random.default_rng(0).integers(10, 250, (len(VERTICES), 3), dtype=np.uint8)
CENTRE = np.full((12, 3), 1.0 / 3.0)


def middles(mesh: TriangleMesh) -> np.ndarray:
    return mesh.points(np.arange(len(mesh)), np.full((len(mesh), 3), 1.0 / 3.0))


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
def test_points_and_colours_come_back(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_coloured(path, VERTICES, FACES, LEVELS)
    mesh = read_mesh(path, MeshOptions(up="z"))
    # OBJ has eight digits, the others float32.
    assert np.abs(middles(mesh) - VERTICES[FACES].mean(axis=1)).max() < 1e-7
    decode = (lambda x: x) if suffix == ".glb" else srgb.decode
    expected = decode(LEVELS / 255.0)[FACES].mean(axis=1)
    assert np.abs(mesh.paint.at(np.arange(12), CENTRE) - expected).max() < 1e-6


def test_the_mesh_of_polycam_is_where_its_cameras_are(tmp_path: Path) -> None:
    """It lay a quarter turn from them, and where Polycam had moved it."""
    turn = trimesh.transformations.rotation_matrix(0.7, [0, 1, 0], [0.3, -0.2, 0.5])
    # Cameras are read with the third row first: the file has our y, z, x.
    raw = VERTICES[:, [1, 2, 0]]
    write_coloured(tmp_path / "raw.glb", trimesh.transform_points(raw, turn), FACES, LEVELS)
    (tmp_path / "mesh_info.json").write_text(json.dumps({"alignmentTransform": turn.T.reshape(-1).tolist()}))
    (tmp_path / "keyframes").mkdir()
    found = middles(read_mesh(tmp_path / "raw.glb"))
    assert np.abs(found - VERTICES[FACES].mean(axis=1)).max() < 1e-6  # single precision: 1e-7
    assert tmp_path / "mesh_info.json" in mesh_files(tmp_path / "raw.glb")
    (tmp_path / "mesh_info.json").write_text(json.dumps({"alignmentTransform": 16 * [1.0]}))
    with pytest.raises(InputError, match=r"mesh_info\.json: alignmentTransform: expected a rigid"):
        read_mesh(tmp_path / "raw.glb")


@pytest.mark.parametrize("name", ["a.obj", "a.glb", "a.gltf"])
def test_textures_are_where_they_belong(tmp_path: Path, name: str) -> None:
    trimesh.Scene(textured_square(quarters())).export(tmp_path / name)
    mesh = read_mesh(tmp_path / name, MeshOptions(up="z"))
    shares = np.random.default_rng(1).dirichlet(np.ones(3), 200)
    faces = np.arange(200) % 2
    x, y = mesh.points(faces, shares)[:, :2].T
    away = np.minimum(abs(x - 0.5), abs(y - 0.5)) > 1e-3
    wanted = np.where(
        y[:, None] > 0.5,
        np.where(x[:, None] < 0.5, [200, 0, 0], [0, 200, 0]),
        np.where(x[:, None] < 0.5, [0, 0, 200], [90, 90, 90]),
    )
    found = mesh.paint.at(faces, shares)
    assert np.abs(found - srgb.decode(wanted / 255.0))[away].max() < 1e-6
    own = {path for path in tmp_path.iterdir() if name != "a.glb" or path.name == name}
    assert set(mesh_files(tmp_path / name)) == own, "all that was written counts for the fingerprint"


def test_nodes_move_their_meshes_and_gltf_is_turned_upright(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    matrix = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [0.1, 0, 0])
    scene.add_geometry(trimesh.Trimesh(VERTICES, FACES, process=False), transform=matrix)
    scene.add_geometry(trimesh.Trimesh(VERTICES + 5.0, FACES, process=False))
    scene.export(tmp_path / "a.glb")
    mesh = read_mesh(tmp_path / "a.glb", MeshOptions(unit=0.01))
    first = VERTICES[FACES].mean(axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
    expected = 0.01 * np.concatenate([first, VERTICES[FACES].mean(axis=1) + 5.0]) @ UPRIGHT[:3, :3].T
    found = middles(mesh)
    order = np.argsort(np.linalg.norm(found, axis=1) > 0.04, kind="stable")
    assert np.abs(found[order] - expected).max() < 1e-8
    assert not mesh.paint.known


def test_triangles_without_area_are_left_out(tmp_path: Path) -> None:
    faces = np.concatenate([FACES, [[0, 0, 1], [3, 3, 3]]])
    trimesh.Trimesh(VERTICES, faces, process=False).export(tmp_path / "a.ply")
    assert len(read_mesh(tmp_path / "a.ply")) == 12


def test_what_is_no_mesh_is_refused_with_what_it_is(tmp_path: Path) -> None:
    trimesh.PointCloud(VERTICES).export(tmp_path / "cloud.ply")
    (tmp_path / "half.glb").write_bytes(b"glTF\x02\0\0\0")
    (tmp_path / "a.fbx").touch()
    trimesh.Trimesh(VERTICES * 1e12, FACES, process=False).export(tmp_path / "far.ply")
    trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False).export(tmp_path / "flat.ply")
    for name, words in {
        "cloud.ply": r"24 points and no triangle.*Poisson",
        "half.glb": "cannot be read",
        "a.fbx": "suffix '.fbx'",
        "none.obj": "no such file",
        "far.ply": "farther away",
        "flat.ply": "none with an area",
    }.items():
        with pytest.raises(InputError, match=words):
            read_mesh(tmp_path / name)


def test_textures_in_other_formats_are_not_opened(tmp_path: Path) -> None:
    square = textured_square(quarters())
    square.export(tmp_path / "a.obj")
    (picture,) = tmp_path.glob("*.png")
    quarters().save(tmp_path / "b.gif")
    (tmp_path / "b.gif").rename(picture)
    with pytest.raises(InputError, match="texture in another format"):
        read_mesh(tmp_path / "a.obj")


def test_a_broken_texture_is_refused(tmp_path: Path) -> None:
    """Pillow says SyntaxError of a chunk whose length was changed, which is no error of the library's reader."""
    square = textured_square(quarters())
    square.export(tmp_path / "a.obj")
    (picture,) = tmp_path.glob("*.png")
    content = bytearray(picture.read_bytes())
    start = content.index(b"IDAT")
    content[start - 4 : start] = (4).to_bytes(4, "big")
    picture.write_bytes(content)
    with pytest.raises(InputError, match="whole textures"):
        read_mesh(tmp_path / "a.obj")


def linked(folder: Path, kind: str) -> tuple[Path, Path]:
    """A textured square, and its texture in a file of its own beside it."""
    square = textured_square(quarters())
    if kind == "obj":  # whose lines end with a carriage return alone
        square.export(folder / "a.obj")
        (materials,) = folder.glob("*.mtl")
        materials.write_bytes(materials.read_bytes().replace(b"\n", b"\r"))
        (picture,) = folder.glob("*.png")
        return folder / "a.obj", picture
    quarters().save(folder / "t.png")
    if kind == "ply":
        square.export(folder / "a.ply")
        content = (folder / "a.ply").read_bytes()
        (folder / "a.ply").write_bytes(content.replace(b"\nelement", b"\ncomment TextureFile t.png\nelement", 1))
        return folder / "a.ply", folder / "t.png"
    text = json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "t.png"}]}).encode().ljust(80)
    header = b"glTF" + struct.pack("<II", 2, 20 + len(text)) + struct.pack("<I", len(text)) + b"JSON"
    (folder / "a.glb").write_bytes(header + text)
    return folder / "a.glb", folder / "t.png"


@pytest.mark.parametrize("kind", ["obj", "ply", "glb"])
def test_what_a_mesh_names_counts_for_the_fingerprint_and_is_no_pipe(tmp_path: Path, kind: str) -> None:
    path, picture = linked(tmp_path, kind)
    assert picture in mesh_files(path)
    picture.unlink()
    os.mkfifo(picture)
    with pytest.raises(InputError, match="pipe"):
        read_mesh(path)


def test_no_file_is_opened_that_a_mesh_does_not_name(tmp_path: Path) -> None:
    path, picture = linked(tmp_path, "ply")
    (tmp_path / "other.png").write_bytes(picture.read_bytes())
    own = OwnFiles(path)
    assert own.get("t.png") == picture.read_bytes()
    with pytest.raises(InputError, match=r"another file, 'other\.png'"):
        own.get("other.png")


@pytest.mark.parametrize("rows", [-1, 1])
def test_text_of_a_ply_has_the_rows_that_it_says(tmp_path: Path, rows: int) -> None:
    """A point that is missing was made up by the first triangle, and those beyond the last were left out."""
    lines = text_ply(tmp_path)
    assert len(read_mesh(tmp_path / "a.ply")) == 12
    first = lines.index("end_header") + 1
    (tmp_path / "a.ply").write_text(
        "\n".join([*lines[:first], *([lines[first]] * rows or []), *lines[first + (rows < 0) :]])
    )
    with pytest.raises(InputError, match=r"a\.ply: (vertex 23|face 0): expected a row of [13] properties"):
        read_mesh(tmp_path / "a.ply")
    (tmp_path / "a.ply").write_text("\n".join(lines[:-1] if rows < 0 else [*lines, lines[-1]]))
    with pytest.raises(InputError, match=rf"a\.ply: expected 36 rows after the header, found {36 + rows}"):
        read_mesh(tmp_path / "a.ply")


def test_text_of_a_ply_may_say_more_rows_than_can_be_counted(tmp_path: Path) -> None:
    """There was a bare ValueError."""
    lines = text_ply(tmp_path)
    (tmp_path / "a.ply").write_text("\n".join(lines).replace("element face 12", f"element face {2**63}"))
    with pytest.raises(InputError, match=r"a\.ply: expected .* rows after the header, found 36"):
        read_mesh(tmp_path / "a.ply")


def text_ply(folder: Path) -> list[str]:
    """Lines of `a.ply`, a box in text."""
    content = trimesh.Trimesh(VERTICES, FACES, process=False).export(file_type="ply", encoding="ascii").decode()
    (folder / "a.ply").write_text(content)
    return content.splitlines()


@pytest.mark.parametrize("change", ["7 3", "", "4"])
def test_a_face_in_text_with_a_number_too_many_or_too_few_is_refused(tmp_path: Path, change: str) -> None:
    """It was read as other triangles, silently."""
    lines = text_ply(tmp_path)
    first = lines.index("end_header") + 25  # after 24 vertices
    lines[first] = lines[first].replace("3", change, 1)
    (tmp_path / "a.ply").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"a\.ply: face 0: expected a row of 1 properties"):
        read_mesh(tmp_path / "a.ply")


def test_a_ply_of_several_textures_is_refused(tmp_path: Path) -> None:
    path, picture = linked(tmp_path, "ply")
    (tmp_path / "u.png").write_bytes(picture.read_bytes())
    path.write_bytes(path.read_bytes().replace(b"\ncomment Tex", b"\ncomment TextureFile u.png\ncomment Tex", 1))
    with pytest.raises(InputError, match=r"a\.ply: expected one texture at most in a PLY, found 2"):
        read_mesh(path)


def square(path: Path, points: tuple[str, ...] = (), faces: str = "", values: str = "", places: str = "") -> Path:
    """A unit square in text, whose points and faces have properties more."""
    head = ["ply", "format ascii 1.0", "element vertex 4", *(f"property float {name}" for name in "xyz")]
    head += [f"property {one}" for one in points] + ["element face 2", "property list uchar int vertex_indices"]
    head += [f"property {faces}"] * bool(faces) + ["end_header"]
    rows = [f"{place} {values}" for place in ("0 0 0", "1 0 0", "1 1 0", "0 1 0")]
    path.write_text("\n".join([*head, *rows, f"3 0 1 2 {places}", f"3 0 2 3 {places}", ""]))
    return path


@pytest.mark.parametrize("kind", ["ushort", "uint16", "short", "int", "char"])
@pytest.mark.parametrize("of", ["vertex", "face"])
def test_colours_of_a_ply_that_are_no_bytes_are_refused(tmp_path: Path, kind: str, of: str) -> None:
    """Of 16 bits the upper ones were left out."""
    given = tuple(f"{kind} {name}" for name in ("red", "green", "blue"))
    if of == "vertex":
        path = square(tmp_path / "a.ply", given, values="1 2 3")
    else:
        path = square(tmp_path / "a.ply", faces="\nproperty ".join(given), places="1 2 3")
    with pytest.raises(InputError, match=rf"a\.ply: element {of}, property red: expected colours in bytes.* {kind}\."):
        read_mesh(path)


@pytest.mark.parametrize(("kind", "values"), [("uchar", "51 102 255"), ("float", "0.2 0.4 1"), ("double", "0.2 0.4 1")])
def test_colours_of_a_ply_are_bytes_or_shares(tmp_path: Path, kind: str, values: str) -> None:
    path = square(tmp_path / "a.ply", tuple(f"{kind} {name}" for name in ("red", "green", "blue")), values=values)
    found = read_mesh(path).paint.corners
    np.testing.assert_allclose(found, np.broadcast_to(srgb.decode(np.array([0.2, 0.4, 1.0])), (2, 3, 3)))


@pytest.mark.parametrize("kind", ["s t", "u v", "texture_u texture_v", "faces"])
@pytest.mark.parametrize("coloured", [False, True])
def test_places_in_no_texture_are_no_white(tmp_path: Path, kind: str, coloured: bool) -> None:
    """They made a mesh white, and hid the colours of its points."""
    points, values = ("uchar red", "uchar green", "uchar blue") * coloured, "51 102 255" * coloured
    if kind == "faces":
        path = square(tmp_path / "a.ply", points, "list uchar float texcoord", values, "6 0 0 1 0 1 1")
    else:
        named = tuple(f"float {name}" for name in kind.split())
        path = square(tmp_path / "a.ply", (*points, *named), values=f"{values} 0.5 0.5")
    paint = read_mesh(path).paint
    assert paint.known == coloured
    if coloured:
        np.testing.assert_allclose(paint.corners[0, 0], srgb.decode(np.array([0.2, 0.4, 1.0])))


@pytest.mark.parametrize("values", ["51 102 255", "0.2 nan 1", "0.2 0.4 -1"])
@pytest.mark.parametrize("of", ["vertex", "face"])
def test_colours_of_a_ply_in_floats_that_are_no_shares_are_refused(tmp_path: Path, values: str, of: str) -> None:
    """Of levels up to 255 all became 1, NaN became 0."""
    given = tuple(f"float {name}" for name in ("red", "green", "blue"))
    if of == "vertex":
        path = square(tmp_path / "a.ply", given, values=values)
    else:
        path = square(tmp_path / "a.ply", faces="\nproperty ".join(given), places=values)
    with pytest.raises(InputError, match=rf"a\.ply: element {of}, property .*: expected floats from 0 to"):
        read_mesh(path)
