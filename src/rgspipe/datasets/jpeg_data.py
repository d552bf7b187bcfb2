"""Whether a JPEG has as many codes as its pixels need: of damage among them a decoder says nothing.

Codes follow each other without a gap, so that damage moves all that come after it, and the decoder is done too early,
and leaves some out, or too late, and makes some up. Which of the two it does is seen by what other bytes there change.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from rgspipe.errors import InputError

#: Markers: of the end, of a scan, and of restarts within one.
END, SCAN, RESTARTS = 0xD9, 0xDA, range(0xD0, 0xD8)

#: Markers of frames with Huffman's codes, whose last scan has whole pixels, or only refines them. Codes of others
#: (arithmetic ones) may leave out bytes at their end.
WHOLE, REFINED = (0xC0, 0xC1), (0xC2,)

#: What ends codes: 0xFF, which no 0 follows.
MARKER = re.compile(rb"\xff+[^\x00\xff]")

#: Bytes that are put in after the codes: more than a block of pixels takes, so that it shows if they are decoded.
MORE = 64

#: Bytes at the end of the codes that must show: cameras that fill up to a multiple of 4 or 8 leave fewer out.
LAST = 8

#: How often other bytes are tried there, as some may happen to show nothing: where all is clipped, for one.
TRIES = 16

Decoder = Callable[[bytes], "np.ndarray | None"]


@dataclass(frozen=True)
class _Codes:
    """Where codes are.

    Attributes:
        frame: the marker of their kind.
        start: of the last scan's.
        ends: of all scans' codes, and of their parts between restarts.
        in_turn: whether restarts, which are numbered from 0 to 7, follow each other.
    """

    frame: int
    start: int
    ends: tuple[int, ...]
    in_turn: bool


def check_codes(path: Path, content: bytes, pixels: np.ndarray, decoded: Decoder) -> None:
    """Refuse a JPEG that can be decoded, and whose codes end before its pixels do, or after them.

    Args:
        pixels: of `content`.
        decoded: the pixels of another one, None if it is refused.

    Raises:
        InputError: naming the file.
    """
    codes = _codes(content)
    if codes is None:
        return
    if not codes.in_turn:
        raise _damaged(path, "restarts that do not follow each other")
    random = np.random.default_rng(0)

    def changed(other: bytes) -> bool:
        return not np.array_equal(pixels, decoded(other))

    def filling(length: int) -> bytes:
        return random.integers(1, 254, length, dtype=np.uint8).tobytes()  # no marker among them

    def shows(start: int) -> bool:
        """Whether the codes from there on have to do with the pixels."""
        end = codes.ends[-1]
        return any(changed(content[:start] + filling(end - start) + content[end:]) for _ in range(TRIES))

    parts = pairwise((0, *codes.ends))
    if changed(b"".join(content[a:b] + filling(MORE) for a, b in parts) + content[codes.ends[-1] :]):
        raise _damaged(path, "codes that end before its pixels do")
    last, middle = max(codes.ends[-1] - LAST, codes.start), (codes.start + codes.ends[-1]) // 2
    # Of one colour everywhere all codes may be the same, whatever their bytes.
    if codes.frame in WHOLE and not shows(last) and shows(middle):
        raise _damaged(path, "codes that go on after its pixels")


def _codes(content: bytes) -> _Codes | None:
    """None where there are none of a kind that is known, or where they do not end."""
    place, frame, start, ends, in_turn = 2, 0, 0, [], True
    while (found := MARKER.match(content, place)) and (kind := content[found.end() - 1]) != END:
        place = found.end() + int.from_bytes(content[found.end() : found.end() + 2], "big")
        if kind in (*WHOLE, *REFINED):
            frame = kind
        if kind == SCAN:
            start = place
            for number, mark in enumerate(MARKER.finditer(content, start)):
                place = mark.start()
                ends.append(place)
                if (kind := content[mark.end() - 1]) not in RESTARTS:
                    break
                in_turn &= kind == RESTARTS[number % len(RESTARTS)]
            else:
                return None
    return _Codes(frame, start, tuple(ends), in_turn) if frame and ends else None


def _damaged(path: Path, found: str) -> InputError:
    remedy = "Copy it anew; if it was so from the first, open it in a program for pictures and write it again."
    return InputError(path, expected="a whole JPEG image", found=found, remedy=remedy)
