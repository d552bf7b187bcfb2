"""Which files belong to a mesh: materials, textures, buffers; no others are opened. Nothing here decodes a mesh."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import parse_json, read_json
from rgspipe.datasets.reading_limits import reading_limits
from rgspipe.errors import InputError

#: Suffixes of meshes, and those of glTF.
GLTF = (".glb", ".gltf")
FORMATS = (".ply", ".obj", *GLTF)

#: Lines of OBJ, MTL and the header of a PLY that name another file; some end with a carriage return alone.
NAMED = re.compile(rb"(?:^|[\r\n])[ \t]*(?:mtllib|map_kd|comment[ \t]+texturefile)[ \t]+([^\r\n]+)", re.IGNORECASE)

#: Bytes of a PLY within which its header ends, and those of a GLB before its JSON.
PLY_HEADER, GLB_HEADER = 65536, 20


def mesh_files(path: Path) -> list[Path]:
    """The file and those that it names, as far as they are there."""
    match path.suffix.lower():
        case ".obj":
            materials = list(_beside(path, _named(path)))
            textures = [file for one in materials for file in _beside(one, _named(one))]
            return [path, *dict.fromkeys([*materials, *textures])]
        case ".gltf":
            content = read_json(path, "a glTF file") if path.is_file() else {}
            return [path, *dict.fromkeys(_beside(path, _uris(content)))]
        case ".glb":
            return [path, *dict.fromkeys(_beside(path, _uris(_glb_content(path))))]
        case ".ply":
            return [path, *dict.fromkeys(_beside(path, _named(path, PLY_HEADER)))]
    return [path]


def _named(path: Path, most: int = -1) -> list[str]:
    if not path.is_file():
        return []
    with input_file(path, "a mesh or its materials", most_bytes=reading_limits().bytes).open("rb") as stream:
        content = stream.read(most)
    return [name.strip().decode(errors="replace") for name in NAMED.findall(content)]


def _glb_content(path: Path) -> object:
    """The JSON of a GLB; nothing where it is broken, which those who decode it say."""
    if not path.is_file():
        return {}
    with input_file(path, "a mesh", most_bytes=reading_limits().bytes).open("rb") as stream:
        header = stream.read(GLB_HEADER)
        length = int.from_bytes(header[12:16], "little")
        content = stream.read(min(length, reading_limits().text_bytes))
    try:
        return parse_json(content.decode())
    except ValueError:
        return {}


def _uris(content: object) -> Iterator[str]:
    for kind in ("buffers", "images"):
        parts = content.get(kind, []) if isinstance(content, dict) else []
        for part in parts if isinstance(parts, list) else []:
            uri = part.get("uri") if isinstance(part, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                yield unquote(uri)


def _beside(path: Path, names: Iterator[str] | list[str]) -> Iterator[Path]:
    for name in names:
        try:
            file = path.parent / name
            if file.exists() and not file.is_dir():
                yield input_file(file, "a file of a mesh")
        except InputError:
            raise
        except (OSError, ValueError):  # no name of a file
            continue
