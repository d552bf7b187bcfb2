"""Photographs of a capture whose files are not all there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rgspipe.datasets.missing_files import missing_of, named
from rgspipe.datasets.scans.frame import Scan, ScanFrame
from rgspipe.errors import InputError


def refuse_missing(scan: Scan) -> None:
    """Refuse a capture of which files of photographs are not there, all of them at once.

    Raises:
        InputError: naming some of them, and how to go on without.
    """
    lacking = _lacking(scan)
    if lacking:
        found = f"{named(_files(lacking))}: no such file ({len(lacking)} of {len(scan.frames)} photographs)"
        remedy = "Copy them there, or go on without these photographs: ScanOptions(missing='leave_out')."
        raise InputError(scan.stated, expected="all files of its photographs", found=found, remedy=remedy)


def without_missing(scan: Scan) -> Scan:
    """The capture without photographs of which a file is not there.

    Raises:
        InputError: that is none.
    """
    lacking = _lacking(scan)
    if not lacking:
        return scan
    count, files = len(lacking), named(_files(lacking))
    if count == len(scan.frames):
        found = f"{files}: no such file (all {count} photographs)"
        raise InputError(scan.stated, expected="photographs whose files are there", found=found, remedy="Copy them.")
    are = "photographs are" if count > 1 else "photograph is"
    note = f"{count} {are} left out, of which a file is missing: {files}"
    kept = tuple(frame for frame in scan.frames if not missing_of(frame.files))
    return replace(scan, frames=kept, notes=(*scan.notes, note))


def _lacking(scan: Scan) -> list[ScanFrame]:
    return [frame for frame in scan.frames if missing_of(frame.files)]


def _files(frames: Sequence[ScanFrame]) -> list[Path]:
    return [path for frame in frames for path in missing_of(frame.files)]
