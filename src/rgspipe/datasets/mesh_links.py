"""Which files belong to a mesh: materials, textures, buffers. Nothing here decodes a mesh."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.reading_limits import reading_limits

#: Suffixes of meshes, and those of glTF.
GLTF = (".glb", ".gltf")
FORMATS = (".ply", ".obj", *GLTF)

#: Lines of OBJ and MTL that name another file.
NAMED = re.compile(rb"^\s*(?:mtllib|map_kd)\s+(.+?)\s*$", re.MULTILINE | re.IGNORECASE)


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
    return [path]


def _named(path: Path) -> list[str]:
    if not path.is_file():
        return []
    content = input_file(path, "a mesh or its materials", most_bytes=reading_limits().bytes).read_bytes()
    return [name.decode(errors="replace") for name in NAMED.findall(content)]


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
            if (path.parent / name).is_file():
                yield path.parent / name
        except (OSError, ValueError):  # no name of a file
            continue
