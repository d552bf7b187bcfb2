"""The training table's row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Record:
    """One row of the training table: a phase, its loss and PSNR on the pixels looked at, seconds since the start."""

    phase: str
    step: int
    loss: float
    psnr: float
    seconds: float


def materials_seconds(records: Sequence[Record]) -> float:
    """Seconds that the newest fit of materials before the geometry took; the one after it takes about as long."""
    before = [record for record in records if record.phase != "geometry"]
    newest = max((index for index, record in enumerate(before) if record.phase == "materials"), default=0)
    start = before[newest - 1].seconds if newest > 0 else 0.0
    return before[-1].seconds - start if before else 0.0
