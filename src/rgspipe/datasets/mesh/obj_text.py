"""The text of an OBJ file as every program reads it, where its decoder here would read something else, or nothing."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

import numpy as np

from rgspipe.datasets.limits import ROUNDING
from rgspipe.datasets.mesh.obj_faces import plain_faces
from rgspipe.errors import InputError

#: A face that counts back from the last point, which those who decode it count from the end of the file; and one with
#: point 0, which they take for the first.
BACKWARDS, NOUGHT = (
    re.compile(rb"^f .*(?<=[ /])-\d", re.MULTILINE),
    re.compile(rb"^f (?:.*[ /])?0+(?=[ /\n]|$)", re.MULTILINE),
)

#: A point with more numbers than its place and a weight.
COLOURED = re.compile(rb"^v(?: +[^\s#]+){5}", re.MULTILINE)

#: What a face counts, by the place between slashes.
COUNTED = (b"v", b"vt", b"vn")


def plain_obj(content: bytes, path: Path) -> bytes:
    """The same mesh with a line for each statement, words apart by one space, points counted from the first, UTF-8;
    faces as `plain_faces` has them.

    Raises:
        InputError: a face has point 0, counts back beyond the first, or crosses itself; colours of points that are no
            shares of 1, or no three.
    """
    content = re.sub(rb"\r\n?", b"\n", content.removeprefix(codecs.BOM_UTF8))
    content = re.sub(rb"\\\n", b" ", content)
    content = re.sub(rb"(?m)^ +", b"", content.replace(b"\t", b" "))
    if COLOURED.search(content):
        _check_colours(content, path)
    if NOUGHT.search(content):
        raise _refusal(path, "0")
    if BACKWARDS.search(content):
        content = _forwards(content, path)
    return plain_faces(content, path).decode("utf-8", "backslashreplace").encode()


def _check_colours(content: bytes, path: Path) -> None:
    """Refuse colours that would be cut off at 1, and points with a weight or an alpha: nobody says which it is."""
    rows = [line.partition(b"#")[0].split()[1:] for line in content.split(b"\n") if line.startswith(b"v ")]
    others = next((len(row) for row in rows if len(row) not in (3, 4, 6)), None)
    values = np.array([row[3:] for row in rows if len(row) == 6], np.float64).reshape(-1, 3)
    if others is None and ((values >= 0.0) & (values <= 1.0 + ROUNDING)).all():
        return
    found = f"colours from {values.min():g} to {values.max():g}" if others is None else f"a point of {others} numbers"
    expected, remedy = "points x y z, or x y z r g b with colours from 0 to 1", "Export it so, or as PLY or GLB."
    raise InputError(path, expected=expected, found=found, remedy=remedy)


def _forwards(content: bytes, path: Path) -> bytes:
    counts, lines = dict.fromkeys(COUNTED, 0), content.split(b"\n")
    for number, line in enumerate(lines):
        kind, _, rest = line.partition(b" ")
        if kind in counts:
            counts[kind] += 1
        elif kind == b"f":
            before = tuple(counts.values())
            lines[number] = b"f " + b" ".join(_corner(corner, before, path) for corner in rest.split())
    return b"\n".join(lines)


def _corner(text: bytes, before: tuple[int, ...], path: Path) -> bytes:
    parts = text.split(b"/")
    for place, (part, count) in enumerate(zip(parts, before, strict=False)):
        if part.startswith(b"-") and part[1:].isdigit():
            index = count + 1 - int(part[1:])
            if index < 1:
                raise _refusal(path, part.decode())
            parts[place] = b"%d" % index
    return b"/".join(parts)


def _refusal(path: Path, found: str) -> InputError:
    expected = "faces of points that are there, counted from 1"
    return InputError(path, expected=expected, found=f"point {found} in one", remedy="Export it again.")
