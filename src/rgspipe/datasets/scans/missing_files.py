"""Photographs that a capture lists and that are not all there, as after a copy that was cut off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rgspipe.datasets.scans.frame import Scan, ScanFrame
from rgspipe.errors import InputError

#: Files that are named.
NAMED = 3


def refuse_missing(scan: Scan) -> None:
    """Refuse a capture of which files of photographs are not there, all of them at once.

    Raises:
        InputError: naming some of them, and how to go on without.
    """
    lacking = [frame for frame in scan.frames if _missing(frame)]
    if lacking:
        raise InputError(
            scan.stated,
            expected="all files of its photographs",
            found=f"{len(lacking)} of {len(scan.frames)} whose files are not all there: no {_named(lacking)}",
            remedy="Copy them there, or go on without these photographs: ScanOptions(missing='leave_out').",
        )


def without_missing(scan: Scan) -> Scan:
    """The capture without photographs of which a file is not there.

    Raises:
        InputError: that is none.
    """
    lacking = [frame for frame in scan.frames if _missing(frame)]
    if not lacking:
        return scan
    if len(lacking) == len(scan.frames):
        found = f"all {len(lacking)} without: no {_named(lacking)}"
        raise InputError(scan.stated, expected="photographs whose files are there", found=found, remedy="Copy them.")
    count = len(lacking)
    photographs = f"{count} photograph{'s' * (count != 1)} {'are' if count != 1 else 'is'} left out"
    note = f"{photographs}, of which a file is missing: {_named(lacking)}"
    kept = tuple(frame for frame in scan.frames if not _missing(frame))
    return replace(scan, frames=kept, notes=(*scan.notes, note))


def _missing(frame: ScanFrame) -> list[Path]:
    return [path for path in frame.files if _is_missing(path)]


def _is_missing(path: Path) -> bool:
    """Whether there is no such file; names that no file can have are told where they are read."""
    try:
        path.stat()
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        return False
    return False


def _named(frames: Sequence[ScanFrame]) -> str:
    missing = [str(path) for frame in frames for path in _missing(frame)]
    return ", ".join(missing[:NAMED]) + (", …" if len(missing) > NAMED else "")
