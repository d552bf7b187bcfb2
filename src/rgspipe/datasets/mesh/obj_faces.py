"""Faces of an OBJ file as its decoder here reads them rightly: triangles for polygons, those with textures apart."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rgspipe.datasets.mesh.polygons import clipped

FACE = re.compile(rb"^f .*", re.MULTILINE)

#: Of digits only that there are some.
DIGITS = bytes.maketrans(b"023456789", b"111111111")

#: What stands in the place of groups, which say nothing here: those that the decoder is to read apart.
APART = (b"g plain", b"g textured")


def plain_faces(content: bytes, path: Path) -> bytes:
    """The same mesh without comments beside numbers and without groups, unless faces with and without places in a
    texture stand in one file: these are two groups, without normals. Of polygons only those stay that a fan covers.

    Raises:
        InputError: a polygon crosses itself.
    """
    content = re.sub(rb"(?m)^g(?: .*)?$", b"", content)
    content = re.sub(rb"(?m)^((?:f|v[tn]?) [^#\n]*)#.*$", rb"\1", content)
    kinds = _kinds(content)
    mixed = len({corner for kind in kinds for corner in kind}) > 1
    if not mixed and all(len(kind) < 4 for kind in kinds):
        return content
    lines = content.split(b"\n")
    numbers = [number for number, line in enumerate(lines) if line.startswith(b"f ")]
    faces = [lines[number].split()[1:] for number in numbers]
    points = [[int(corner.partition(b"/")[0]) - 1 for corner in face] for face in faces]
    triangles = clipped(_places(lines), points, path)
    for index, (number, face) in enumerate(zip(numbers, faces, strict=True)):
        first, face = _styled(face) if mixed else ([], face)
        parts = [[face[corner] for corner in one] for one in triangles[index]] if index in triangles else [face]
        lines[number] = b"\n".join([*first, *(b"f " + b" ".join(part) for part in parts)])
    return b"\n".join(lines)


def _kinds(content: bytes) -> list[list[bytes]]:
    """Faces of each kind once, with 1 for every number: of points, with a place in the texture, a normal, or both.

    Of faces of several kinds the decoder takes some for others, and no texture for any.
    """
    text = b"\n".join(FACE.findall(content)).translate(DIGITS)
    while b"11" in text:
        text = text.replace(b"11", b"1")
    return [[corner.rstrip(b"/") for corner in kind.split()[1:]] for kind in set(text.split(b"\n"))]


def _places(lines: list[bytes]) -> np.ndarray:
    return np.array([line.split()[1:4] for line in lines if line.startswith(b"v ")], np.float64).reshape(-1, 3)


def _styled(face: list[bytes]) -> tuple[list[bytes], list[bytes]]:
    """The group of a face, and its corners without what those of others in the group have not."""
    parts = [corner.split(b"/") for corner in face]
    textured = all(len(part) > 1 and part[1] for part in parts)
    return [APART[textured]], [b"/".join(part[: 1 + textured]) for part in parts]
