"""Which files belong to a mesh: materials, textures, buffers; no others are opened. Nothing here decodes a mesh."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from rgspipe.datasets.input_file import input_file, is_there
from rgspipe.datasets.json_file import parse_json, read_json, shown
from rgspipe.datasets.mesh.obj_materials import ObjMaterials, read_materials
from rgspipe.datasets.mesh.polycam_place import polycam_info
from rgspipe.datasets.reading_limits import reading_limits
from rgspipe.errors import InputError

#: What in the header of a PLY names a picture.
NAMED = re.compile(rb"texturefile([^\r\n]+)", re.IGNORECASE)

#: Bytes of a PLY within which its header ends, and those of a GLB before its JSON.
PLY_HEADER, GLB_HEADER = 65536, 20


@dataclass(frozen=True)
class Links:
    """What a mesh names.

    Attributes:
        buffers, textures: files by the names that those who decode the mesh have for them, whether they are there or
            not.
        materials: of an OBJ.
    """

    buffers: dict[str, Path] = field(default_factory=dict)
    textures: dict[str, Path] = field(default_factory=dict)
    materials: ObjMaterials | None = None

    @property
    def files(self) -> list[Path]:
        """All of them, each once."""
        materials = [] if self.materials is None else self.materials.files
        return list(dict.fromkeys([*materials, *self.buffers.values(), *self.textures.values()]))

    def there(self) -> list[Path]:
        """Those of them that there are.

        Raises:
            InputError: one is no regular file, or too large.
        """
        most = reading_limits().bytes
        return [input_file(file, "a file of a mesh", most_bytes=most) for file in self.files if is_there(file)]


def mesh_links(path: Path) -> Links:
    """What a mesh names; nothing where it is broken, which those who decode it say.

    Raises:
        InputError: no such file, a name outside of its folder, or materials that would be read wrongly.
    """
    file = input_file(path, "a mesh", most_bytes=reading_limits().bytes)

    def named(by: Path, name: str) -> Path:
        return _place(file, by, name)

    match path.suffix.lower():
        case ".obj":
            materials = read_materials(file, named)
            return Links(textures=materials.textures, materials=materials)
        case ".gltf" | ".glb":
            content = gltf_content(file)
            parts = ({uri: named(file, unquote(uri)) for uri in _uris(content, key)} for key in ("buffers", "images"))
            return Links(*parts)
        case ".ply":
            return Links(textures={name: named(file, name) for name in _of_header(file)})
    return Links()


def mesh_files(path: Path) -> list[Path]:
    """The file and those that it names, or that say where it is, as far as they are there.

    Raises:
        InputError: as `mesh_links`, but for a file that is missing; or one of them is no regular file.
    """
    if not path.exists():
        return [path]
    info = polycam_info(path)
    return [path, *mesh_links(path).there(), *([] if info is None else [info])]


def _place(mesh: Path, by: Path, name: str) -> Path:
    """The file that another one of a mesh names, which lies in the folder of the mesh or below.

    Raises:
        InputError: it lies elsewhere.
    """
    # Programs on Windows write backslashes.
    places = [Path(os.path.normpath(by.parent / text)) for text in dict.fromkeys([name, name.replace("\\", "/")])]
    place = next((one for one in places if is_there(one)), places[-1])
    if Path(os.path.relpath(place, mesh.parent)).parts[:1] == ("..",):
        expected, remedy = "names of files in the folder of the mesh or below", "Move the file there, and name it so."
        raise InputError(by, expected=expected, found=shown(name), remedy=remedy)
    return place


def _of_header(path: Path) -> list[str]:
    with path.open("rb") as stream:
        header = stream.read(PLY_HEADER).partition(b"end_header")[0]
    return [name.decode(errors="surrogateescape").strip() for name in NAMED.findall(header)]


def gltf_content(path: Path) -> object:
    """The JSON of a glTF file or a GLB; of a broken GLB nothing.

    Raises:
        InputError: a glTF file is no JSON.
    """
    return _glb_content(path) if path.suffix.lower() == ".glb" else read_json(path, "a glTF file")


def _glb_content(path: Path) -> object:
    with path.open("rb") as stream:
        header = stream.read(GLB_HEADER)
        length = int.from_bytes(header[12:16], "little")
        content = stream.read(min(length, reading_limits().text_bytes))
    try:
        return parse_json(content.decode())
    except ValueError:
        return None


def _uris(content: object, key: str) -> Iterator[str]:
    parts = content.get(key, []) if isinstance(content, dict) else []
    for part in parts if isinstance(parts, list) else []:
        uri = part.get("uri") if isinstance(part, dict) else None
        if isinstance(uri, str) and not uri.startswith("data:"):
            yield uri
