"""The header of a PLY file against the size of the file: reading one believes it, whatever it claims."""

from __future__ import annotations

import itertools
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rgspipe.datasets.reading_limits import RAISE, reading_limits
from rgspipe.errors import InputError

#: Bytes of the longest header.
LONGEST = 2**20

#: Names of numbers, as PLY and as numpy have them.
KINDS = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4",
    "float64": "f8",
}  # fmt: skip

#: What a property is called in the place of its kind where it has several numbers, after how many.
LIST = "list"


#: Properties that say where points of a mesh are and which colours they have, the latter in bytes or as floats up to 1.
PLACES, COLOURS = ("x", "y", "z", "nx", "ny", "nz"), ("red", "green", "blue", "alpha")
COLOUR_KINDS = ("u1", "f4", "f8")

#: The element of strips of triangles.
STRIPS = "tristrips"

#: The list of a face's places in a texture.
FACE_PLACES = "texcoord"


@dataclass
class _Element:
    name: str
    count: int
    kinds: list[str] = field(default_factory=list)
    names: list[str] = field(default_factory=list)


def check_header(path: Path) -> None:
    """Refuse what claims more rows than the file has bytes for, and rows of lists, whose lengths nothing bounds.

    What is no header at all is left to the reader.

    Raises:
        InputError: naming the element and the property.
    """
    head, lines = _head(path)
    if not lines:
        return
    text = ["format", "ascii", "1.0"] in lines
    size = path.stat().st_size - len(head)
    for element in _elements(path, lines):
        if element.count > (most := reading_limits().vertices):
            raise InputError(
                f"{path}: element {element.name}",
                expected=f"at most {most} rows",
                found=f"{element.count}",
                remedy=f"Crop or thin it out. {RAISE}",
            )
        # In text each number takes a digit and a separator.
        row = sum(2 if text else np.dtype(KINDS.get(kind, "u1")).itemsize for kind in element.kinds)
        if element.count * max(row, 1) > size:
            raise InputError(
                f"{path}: element {element.name}",
                expected=f"a whole PLY file with {element.count} rows of at least {max(row, 1)} bytes",
                found=f"{size} bytes",
                remedy="Export it again.",
            )


def check_colours(path: Path) -> None:
    """Refuse colours of a mesh in other numbers than bytes and floats: those who decode it take them modulo 256.

    What is no header at all is left to the reader.

    Raises:
        InputError: names the element and the property.
    """
    for element in _listed(_head(path)[1]):
        for kind, name in zip(element.kinds, element.names, strict=True):
            if name in COLOURS and KINDS.get(kind) not in COLOUR_KINDS:
                raise InputError(
                    f"{path}: element {element.name}, property {name}",
                    expected="colours in bytes (uchar), or as floats from 0 to 1",
                    found=kind,
                    remedy="Export the mesh again with colours in bytes.",
                )


def check_strips(path: Path) -> None:
    """Refuse strips of triangles, which those who decode a mesh leave out.

    What is no header at all is left to the reader.

    Raises:
        InputError: names the element.
    """
    for element in _listed(_head(path)[1]):
        if element.name == STRIPS and element.count:
            raise InputError(
                f"{path}: element {element.name}",
                expected="faces",
                found="strips of triangles",
                remedy="Triangulate the faces when you export it.",
            )


def without_texture(content: bytes) -> bytes:
    """A mesh whose places in a texture have other names, where there is none: decoders make a white one up for them.

    Colours of points, which they would leave out for it, are then seen.
    """
    head, end, rest = content.partition(b"end_header")
    if len(head) > LONGEST:
        return content
    lines, element = head.splitlines(keepends=True), b""
    for number, line in enumerate(lines):
        words = line.split()
        if words[:1] == [b"element"]:
            element = (words[1:2] or [b""])[0]
        elif words[:1] == [b"property"] and len(words) > 2:
            name = words[-1].decode(errors="replace")
            told = name in (*PLACES, *COLOURS) if element == b"vertex" else name != FACE_PLACES
            place = line.rindex(words[-1])
            lines[number] = line if told else line[:place] + b"unused_" + line[place:]
    return b"".join(lines) + end + rest


def _head(path: Path) -> tuple[bytes, list[list[str]]]:
    """What stands before the end of a header, as it is and by lines and words; no lines where there is no header."""
    with path.open("rb") as stream:
        head, end, _ = stream.read(LONGEST).partition(b"end_header")
    return head, [line.split() for line in head.decode("ascii", errors="replace").splitlines()] if end else []


def check_rows(path: Path) -> None:
    """Refuse text whose rows are not those of its header: whoever reads it takes one element's for another's, or reads
    what a number too many has shifted.

    What is no header at all is left to the reader.

    Raises:
        InputError: names the row.
    """
    with path.open("rb") as stream:
        lines: list[list[str]] = []
        while lines[-1:] != [["end_header"]]:
            line = stream.readline(LONGEST)
            if not line or stream.tell() > LONGEST:
                return
            lines.append(line.decode("ascii", errors="replace").split())
        if not any(line[:2] == ["format", "ascii"] for line in lines):
            return
        rows = (words for line in stream if (words := line.split()))
        read = 0
        for element in _listed(lines):
            for number, words in enumerate(itertools.islice(rows, min(element.count, sys.maxsize))):
                read += 1
                if not _fits(words, element.kinds):
                    expected = f"a row of {len(element.kinds)} properties"
                    found, remedy = f"{len(words)} words: {b' '.join(words)[:60]!r}", "Export it again."
                    raise InputError(f"{path}: {element.name} {number}", expected=expected, found=found, remedy=remedy)
        rest = sum(1 for _ in rows)
    claimed = sum(element.count for element in _listed(lines))
    if read + rest != claimed:
        expected, remedy = f"{claimed} rows after the header", "Export it again, or copy it anew."
        raise InputError(path, expected=expected, found=f"{read + rest}", remedy=remedy)


def _fits(words: list[bytes], kinds: list[str]) -> bool:
    """Whether a row has a word for each property, and for each entry of a list as many as it says first."""
    if LIST not in kinds:
        return len(words) == len(kinds)
    place = 0
    for kind in kinds:
        entries = words[place : place + 1]
        place += 1
        if kind == LIST:
            place += int(entries[0]) if entries and entries[0].isdigit() and len(entries[0]) < 10 else 0
    return place == len(words)


def _elements(path: Path, lines: list[list[str]]) -> list[_Element]:
    """The elements of a header without lists."""
    elements = _listed(lines)
    for element in elements:
        if LIST in element.kinds and element.count:
            raise InputError(
                f"{path}: element {element.name}, property {element.names[element.kinds.index(LIST)]}",
                expected="one number for each vertex",
                found="a list",
                remedy="Export the file again, without faces.",
            )
    return elements


def _listed(lines: list[list[str]]) -> list[_Element]:
    elements: list[_Element] = []
    for words in lines:
        if words[:1] == ["element"] and len(words) == 3 and words[2].isdecimal() and len(words[2]) < 20:
            elements.append(_Element(words[1], int(words[2])))
        elif words[:1] == ["property"] and elements and len(words) > 2:
            elements[-1].kinds.append(words[1])
            elements[-1].names.append(words[-1])
    return elements
