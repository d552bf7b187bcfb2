"""The vertices of a PLY file as columns of numbers, read with errors that name file, element and property."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement, PlyListProperty, PlyParseError

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.ply.header import check_header
from rgspipe.datasets.reading_limits import timed
from rgspipe.errors import InputError
from rgspipe.store.files import replacing

ELEMENT = "vertex"

#: Rows read at once. Files lie row after row, so columns that are read one by one would read the whole file each.
BLOCK = 8192


@dataclass(frozen=True)
class VertexTable:
    """The element "vertex" of a PLY file.

    Attributes:
        path: the file, for errors.
        element: as it was read.
        comments: of the header.
    """

    path: Path
    element: PlyElement
    comments: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.element.data)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the properties."""
        return tuple(item.name for item in self.element.properties)

    def numbered(self, prefix: str) -> list[str]:
        """The properties `prefix0`, `prefix1`, … in the order of their numbers, at least one and none left out.

        Raises:
            InputError: there is none, or one is missing in between.
        """
        count = sum(name.startswith(prefix) and name[len(prefix) :].isdecimal() for name in self.names)
        wanted = [f"{prefix}{index}" for index in range(max(count, 1))]
        self._require(wanted)
        return wanted

    def columns(self, *names: str) -> np.ndarray:
        """(N, len(names)) float64 values of properties.

        Raises:
            InputError: one is missing, is a list, or has values that are not finite.
        """
        values = np.empty((len(self), len(names)), np.float64)
        for rows, block in self.blocks(*names):
            values[rows] = block
        return values

    def blocks(self, *names: str) -> Iterator[tuple[slice, np.ndarray]]:
        """The values of properties as `columns` gives them, some rows at a time: (rows, (rows, len(names)) float64).

        Raises:
            InputError: as `columns`.
        """
        self._require(names)
        for name in names:
            if isinstance(self.element.ply_property(name), PlyListProperty):
                raise self._error(name, "one number for each vertex", "a list", "Export the file again.")
        for start in range(0, len(self), BLOCK):
            rows = slice(start, min(start + BLOCK, len(self)))
            block = np.stack([self.element.data[name][rows] for name in names], axis=1, dtype=np.float64)
            if not np.isfinite(block).all():
                raise self._not_finite(names)
            yield rows, block

    def _not_finite(self, names: Sequence[str]) -> InputError:
        """The error for the first of `names` that has such values."""
        bad = {name: np.flatnonzero(~np.isfinite(np.asarray(self.element.data[name], np.float64))) for name in names}
        name, rows = next((name, rows) for name, rows in bad.items() if len(rows))
        found = f"{len(rows)} values that are not, the first in row {rows[0]}"
        return self._error(name, "finite numbers", found, "Remove those vertices, or export the file again.")

    def error(self, name: str, expected: str, found: str) -> InputError:
        """An error about the values of a property."""
        return self._error(name, expected, found, "Correct them, or export the file again.")

    def _require(self, names: Sequence[str]) -> None:
        for name in names:
            if name not in self.names:
                listed = ", ".join(self.names[:24]) + (", …" if len(self.names) > 24 else "")
                remedy = "Export the file again with all of its properties."
                raise self._error(name, "this property", f"only {listed or 'none'}", remedy)

    def _error(self, name: str, expected: str, found: str, remedy: str) -> InputError:
        where = f"{self.path}: element {ELEMENT}, property {name}"
        return InputError(where, expected=expected, found=found, remedy=remedy)


@timed
def read_vertices(path: str | Path) -> VertexTable:
    """The vertices of a PLY file, ASCII or binary; binary values stay on the disk until they are asked for.

    Raises:
        InputError: no such file, no PLY file, cut off, or without vertices.
    """
    path = input_file(path, "a PLY file")
    check_header(path)
    try:
        with np.errstate(over="ignore"):  # numbers of a text that no float holds are infinite, which is refused
            content = PlyData.read(str(path), mmap="r")
    # The library lets errors of numpy and of decoding through.
    except (PlyParseError, OSError, ValueError, TypeError, KeyError, OverflowError, MemoryError) as error:
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            path, expected="a whole PLY file", found=f"one that cannot be read ({why})", remedy="Export it again."
        ) from error
    if ELEMENT not in content or not len(content[ELEMENT].data):
        listed = ", ".join(f"{item.name} ({len(item.data)})" for item in content.elements) or "none"
        raise InputError(
            f"{path}: element {ELEMENT}", expected="at least one vertex", found=f"elements: {listed}",
            remedy="Use a file of surfels or Gaussians.",
        )  # fmt: skip
    return VertexTable(path, content[ELEMENT], tuple(content.comments))


def write_vertices(path: str | Path, columns: Mapping[str, np.ndarray], comments: Sequence[str]) -> None:
    """Write columns (N,) as float properties, binary little-endian, in their order; whole or not at all."""
    count = len(next(iter(columns.values())))
    data = np.empty(count, dtype=[(name, "<f4") for name in columns])
    for name, values in columns.items():
        data[name] = values
    content = PlyData([PlyElement.describe(data, ELEMENT)], byte_order="<", comments=list(comments))
    with replacing(path) as temporary:
        content.write(str(temporary))
