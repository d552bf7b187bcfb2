"""Measured luminaires: LM-63 files (IES, 1986 to 2019) and EULUMDAT files (LDT), type C photometry."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NoReturn

import torch

from rgspipe.arguments import as_path
from rgspipe.datasets.input_file import input_file, input_folder
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.errors import InputError
from rgspipe.scene.lights import Photometry

#: Angles of the finest table, along and across: what no luminaire has.
MOST_ANGLES = 2000

#: The largest candela, far beyond a lighthouse's.
BRIGHTEST = 1e15

#: Angles [degrees] nearer than this are one.
SAME = 1e-4

#: Photometric types of LM-63 by their number.
TYPES = {1: "C", 2: "B", 3: "A"}

#: The first line of LM-63 since 1995, and since when its twelfth number is no factor.
STANDARD, UNUSED_SINCE = re.compile(r"\s*IES(?:NA)?:LM-63-(\d{4})", re.IGNORECASE), 2002

#: Numbers of LM-63 before the angles, and of EULUMDAT's sets of lamps and direct ratios lines.
HEADER, LAMP_LINES, RATIOS = 13, 6, 10


@timed
def read_photometry(path: str | Path) -> Photometry:
    """The table of a luminaire, by the ending of its name: .ies or .ldt.

    Raises:
        InputError: missing, too large, no such file, or something in it that cannot be.
    """
    path = as_path(path)
    _reader(path)
    limit = reading_limits().text_bytes
    return photometry_of(input_file(path, "a measured luminaire", most_bytes=limit).read_bytes(), path)


def photometry_of(content: bytes, path: Path) -> Photometry:
    """The table of a luminaire whose file, with this content, is or was `path`.

    Raises:
        InputError: too large, no such file, or something in it that cannot be.
    """
    reader, limit = _reader(path), reading_limits().text_bytes
    if len(content) > limit:
        _refuse(path, f"a measured luminaire of at most {limit} bytes", f"{len(content)} bytes", "Check the file.")
    text = content.decode("latin-1")
    return reader(_Source(path, text.removeprefix("ï»¿").replace("\r\n", "\n").replace("\r", "\n")))


def _reader(path: Path) -> Callable[[_Source], Photometry]:
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        _refuse(path, " or ".join(READERS), path.suffix or "no ending", "Name a measured luminaire's file.")
    return reader


def read_catalogue(folder: str | Path) -> dict[str, Photometry]:
    """The tables of all luminaires in a folder, by file name.

    Raises:
        InputError: no folder, no file in it, or a file that cannot be read.
    """
    folder = input_folder(folder, "a folder of measured luminaires")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in READERS)
    if not paths:
        _refuse(folder, f"files that end in {' or '.join(READERS)}", "none", "Name another folder.")
    return {path.name: read_photometry(path) for path in paths}


@dataclass(frozen=True)
class _Source:
    """The text of a file."""

    path: Path
    text: str

    def refuse(self, expected: str, found: str) -> NoReturn:
        _refuse(self.path, expected, found, "Get the file again from its maker, or correct it.")

    def number(self, word: str, what: str) -> float:
        """Numbers may have a decimal comma."""
        try:
            value = float(word.strip().replace(",", "."))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.refuse(f"a number for {what}", repr(word[:40]))
        return value

    def count(self, word: str, what: str) -> int:
        value = self.number(word, what)
        if not (value == int(value) and 1 <= value <= MOST_ANGLES):
            self.refuse(f"{what} from 1 to {MOST_ANGLES}", repr(word[:40]))
        return int(value)

    def table(self, vertical: Sequence[float], planes: dict[float, Sequence[float]], factor: float) -> Photometry:
        """Of candela, over `factor`, by vertical angle in each plane [degrees].

        Files count planes anticlockwise as seen from above (LM-63-2002, 3), lights clockwise.
        """
        planes = {-angle % 360.0: column for angle, column in planes.items()}
        angles = [math.radians(min(angle, 180.0)) for angle in vertical]
        horizontal = sorted(planes)
        candela = factor * torch.tensor([list(planes[angle]) for angle in horizontal], dtype=torch.float64).T
        if not (bool(torch.isfinite(candela).all()) and float(candela.min()) >= 0.0 and candela.max() <= BRIGHTEST):
            self.refuse(f"candela from 0 to {BRIGHTEST:g}", f"{float(candela.min()):g} to {float(candela.max()):g}")
        turns = torch.deg2rad(torch.tensor(horizontal, dtype=torch.float64))
        rows = torch.tensor(angles, dtype=torch.float64)
        if rows[0] > 0.0:  # Dark from straight along the axis to where the table begins.
            edge = torch.tensor([0.0, float(rows[0]) * (1.0 - SAME)], dtype=torch.float64)
            rows, candela = torch.cat([edge, rows]), torch.cat([torch.zeros(2, candela.shape[1]).double(), candela])
        try:
            return Photometry.measured(rows, turns, candela, self.path.name)
        except ValueError as error:
            self.refuse("a table of intensities", str(error))


def _ies(source: _Source) -> Photometry:
    head, mark, rest = source.text.partition("TILT=")
    if not mark or ("\n" not in head and head.strip()):
        source.refuse("a line TILT=… after those of the header", "none")
    tilt, _, numbers = rest.partition("\n")
    words = iter(numbers.replace(",", " ").split())
    if tilt.strip().upper() == "INCLUDE":
        _skip_tilt(source, words)
    elif tilt.strip().upper() != "NONE":
        source.refuse("TILT=NONE or TILT=INCLUDE", f"TILT={tilt.strip()[:40]}")
    header = list(_take(source, words, HEADER, "the header's numbers"))
    count, planes = (source.count(f"{header[k]:g}", what) for k, what in ((3, "vertical angles"), (4, "planes")))
    kind = TYPES.get(int(header[5]), f"{header[5]:g}")
    if kind != "C":
        source.refuse("type C photometry", f"type {kind}: angles around another axis")
    vertical = list(_take(source, words, count, "vertical angles"))
    turns = list(_take(source, words, planes, "horizontal angles"))
    _check_rising(source, vertical, turns)
    columns = {turn: list(_take(source, words, count, "candela")) for turn in turns}
    if extra := next(words, None):
        source.refuse(f"{planes} × {count} candela", f"more: {extra[:40]!r}")
    # Multiplier, ballast factor, and that of ballast and lamp together, in the place of which later standards have a
    # number without a use (2002), and how the file was made (2019: 1.10101, for one).
    together = header[11] if _year(head) < UNUSED_SINCE else 1.0
    return source.table(vertical, _all_around(source, columns), header[2] * header[10] * together)


def _year(head: str) -> int:
    """Of the standard, by the first line: `IESNA:LM-63-1995`, `IES:LM-63-2019`; 0 of older ones, as `IESNA91`."""
    stated = STANDARD.match(head)
    return int(stated[1]) if stated else 0


def _skip_tilt(source: _Source, words: Iterator[str]) -> None:
    """How lamps dim when they are tilted: ours hang as they were measured."""
    _, pairs = _take(source, words, 2, "TILT")
    list(_take(source, words, 2 * source.count(f"{pairs:g}", "pairs of TILT"), "TILT"))


def _take(source: _Source, words: Iterator[str], count: int, what: str) -> Iterator[float]:
    for _ in range(count):
        word = next(words, None)
        if word is None:
            source.refuse(f"{count} numbers for {what}", "the end of the file")
        yield source.number(word, what)


def _check_rising(source: _Source, vertical: Sequence[float], turns: Sequence[float]) -> None:
    for name, angles, most in (("vertical", vertical, 180.0), ("horizontal", turns, 360.0)):
        steps = [after - before for before, after in pairwise(angles)]
        if angles[0] < 0.0 or angles[-1] > most + SAME or min(steps, default=1.0) < SAME:
            source.refuse(f"{name} angles that rise from 0° or above to at most {most:g}°", f"{angles[:4]} …")


def _all_around(source: _Source, columns: dict[float, list[float]]) -> dict[float, list[float]]:
    """The planes of LM-63 for a full turn, by the symmetry that the last of them tells."""
    first, last = min(columns), max(columns)
    if len(columns) == 1:
        return {0.0: columns[first]}
    reach = (round(first, 3), round(last, 3))
    mirrors = {(0, 90): (180.0, 360.0), (0, 180): (360.0,), (90, 270): (180.0,), (0, 360): ()}.get(reach)
    if mirrors is None and first == 0.0 and last > 180.0:
        mirrors = ()
    if mirrors is None:
        source.refuse("planes from 0° to 0°, 90°, 180° or 360°, or from 90° to 270°", f"{first:g}° to {last:g}°")
    return _mirrored(columns, mirrors)


def _mirrored(columns: dict[float, list[float]], mirrors: Sequence[float]) -> dict[float, list[float]]:
    """Planes, and their images at angles `mirror` less theirs; one of each angle below 360°."""
    for mirror in mirrors:
        columns = columns | {mirror - angle: column for angle, column in columns.items()}
    found: dict[float, list[float]] = {}
    for angle, column in columns.items():
        found.setdefault(round(angle % 360.0, 4) % 360.0, column)
    return found


def _ldt(source: _Source) -> Photometry:
    lines = source.text.split("\n")

    def line(index: int, what: str) -> str:
        if index >= len(lines):
            source.refuse(f"line {index + 1} with {what}", "the end of the file")
        return lines[index]

    symmetry = source.number(line(2, "the symmetry"), "the symmetry")
    if symmetry not in range(5):
        source.refuse("a symmetry from 0 to 4 in line 3", repr(lines[2][:40]))
    planes, count = source.count(line(3, "planes"), "planes"), source.count(line(5, "angles"), "angles")
    if planes % {2: 2, 3: 4, 4: 4}.get(int(symmetry), 1):
        source.refuse(f"planes that suit the symmetry {symmetry:g}", str(planes))
    factor = source.number(line(23, "the conversion factor"), "the conversion factor")
    sets = source.count(line(25, "sets of lamps"), "sets of lamps")
    flux = source.number(line(28, "the luminous flux"), "the luminous flux")
    first = 26 + LAMP_LINES * sets + RATIOS
    known = _known_planes(int(symmetry), planes)
    line(first + planes + count + len(known) * count - 1, "the last intensity")
    values = [source.number(word, f"line {first + k + 1}") for k, word in enumerate(lines[first:]) if word.strip()]
    turns, vertical, rest = values[:planes], values[planes : planes + count], values[planes + count :]
    _check_rising(source, vertical, turns)
    if len(rest) != len(known) * count:
        source.refuse(f"{len(known)} × {count} intensities", str(len(rest)))
    columns = {turns[plane]: rest[k * count : (k + 1) * count] for k, plane in enumerate(known)}
    if symmetry == 1:
        columns = {0.0: columns[turns[0]]}
    mirrors = {2: (360.0,), 3: (180.0,), 4: (180.0, 360.0)}.get(int(symmetry), ())
    # Candela per 1000 lm of the lamps.
    return source.table(vertical, _mirrored(columns, mirrors), factor * abs(flux) / 1000.0)


def _known_planes(symmetry: int, planes: int) -> list[int]:
    """Which of the planes of a full turn an EULUMDAT file has intensities of."""
    if symmetry == 0:
        return [*range(planes)]
    if symmetry == 1:
        return [0]
    if symmetry == 3:
        return [(3 * planes // 4 + k) % planes for k in range(planes // 2 + 1)]
    return [*range(planes // (2 if symmetry == 2 else 4) + 1)]


def _refuse(path: Path, expected: str, found: str, remedy: str) -> NoReturn:
    raise InputError(path, expected=expected, found=found, remedy=remedy)


#: By the ending of a file's name.
READERS: dict[str, Callable[[_Source], Photometry]] = {".ies": _ies, ".ldt": _ldt}
