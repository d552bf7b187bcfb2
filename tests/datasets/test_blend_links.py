"""What a .blend names counts for the fingerprint: files written by Blender, traced without it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.blend_links import blend_links
from rgspipe.errors import InputError
from rgspipe.stages.images.generate_dataset import STAGE

pytest.importorskip("bpy")

#: A cube with a texture beside the file, a cube of a library with a texture of its own, tiles, and a packed texture.
WRITE = """
import sys
from pathlib import Path
import bpy

folder = Path(sys.argv[1])

def texture(name, pack=False):
    image = bpy.data.images.new(name, 4, 4)
    image.filepath_raw, image.file_format = str(folder / name), "PNG"
    image.save()
    image.source = "FILE"
    if pack:
        image.pack()
    return image

def cube(image):
    bpy.ops.mesh.primitive_cube_add()
    material = bpy.data.materials.new(image.name)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["Principled BSDF"].inputs[0])
    bpy.context.object.data.materials.append(material)
    return bpy.context.object

bpy.ops.wm.read_factory_settings(use_empty=True)
cube(texture("of_library.png")).name = "lent"
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "library.blend"), compress=True)
bpy.ops.wm.read_factory_settings(use_empty=True)
cube(texture("own.png"))
cube(texture("packed.png", pack=True))
texture("tile.1002.png")
tiles = texture("tile.1001.png")
tiles.source = "TILED"
tiles.filepath = str(folder / "tile.<UDIM>.png")
cube(tiles)
with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (there, wanted):
    wanted.objects = ["lent"]
bpy.context.scene.collection.objects.link(wanted.objects[0])
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"), relative_remap=True)
"""

NAMED = {"library.blend", "of_library.png", "own.png", "tile.1001.png", "tile.1002.png"}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Blender's process wrote it."""
    folder = tmp_path_factory.mktemp("blend")
    subprocess.run([sys.executable, "-c", WRITE, str(folder)], check=True, capture_output=True, timeout=300)
    return folder


@pytest.fixture
def room(written: Path, tmp_path: Path) -> Path:
    """A copy to change, in another place: the names in it are relative."""
    for path in written.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path / "room.blend"


def _config(path: Path) -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {"scene.kind": "blend", "scene.path": str(path)})


def test_what_it_names_counts_and_what_it_packs_does_not(room: Path) -> None:
    files = STAGE.files(_config(room))
    assert files[0] == room
    assert {path.name for path in files[1:]} == NAMED
    assert all(path.parent == room.parent for path in files)
    assert STAGE.remarks(_config(room), {}) == ()


def test_a_tile_that_comes_later_counts_as_well(room: Path) -> None:
    before = blend_links(room).files
    (room.parent / "tile.1003.png").write_bytes(b"")
    assert set(blend_links(room).files) - set(before) == {room.parent / "tile.1003.png"}


def test_what_is_not_there_is_told(room: Path) -> None:
    (room.parent / "of_library.png").unlink()
    assert "of_library.png" not in {path.name for path in STAGE.files(_config(room))}
    (remark,) = STAGE.remarks(_config(room), {})
    assert "of_library.png" in remark
    assert "pink" in remark


def test_a_pipe_is_not_waited_for(room: Path) -> None:
    (room.parent / "own.png").unlink()
    os.mkfifo(room.parent / "own.png")
    with pytest.raises(InputError, match=r"own\.png.*pipe"):
        STAGE.files(_config(room))


def test_a_folder_counts_below_that_of_the_file_alone(room: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    texture = room.parent / "own.png"
    texture.unlink()
    texture.mkdir()
    assert texture in blend_links(room).files
    texture.rmdir()
    assert texture in blend_links(room).missing
    texture.symlink_to(tmp_path_factory.mktemp("elsewhere"), target_is_directory=True)
    assert {path.name for path in blend_links(room).files[1:]} == NAMED - {"own.png"}


@pytest.mark.parametrize("part", [slice(0, 3000), slice(100, None), slice(0, 0)], ids=["cut off", "no head", "empty"])
def test_of_a_damaged_file_it_is_told_that_nobody_knows(room: Path, part: slice) -> None:
    """Blender refuses it, or, where it can still read it, renders it; both come later."""
    room.write_bytes(room.read_bytes()[part])
    assert STAGE.files(_config(room)) == (room,)
    (remark,) = STAGE.remarks(_config(room), {})
    assert "changes of them go unnoticed" in remark


def test_a_file_that_leads_in_circles_ends(room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pointers of damaged files may; memory or time runs out, and the plan goes on."""
    monkeypatch.setattr("rgspipe.datasets.blend_links.PATIENCE", 0.01)
    room.touch()
    assert "takes more than 0 s" in blend_links(room).unknown[room]
