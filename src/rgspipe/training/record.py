"""The training table's row."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Record:
    """One row of the training table: a phase, its loss as PSNR on training pixels, and the seconds since the start."""

    phase: str
    step: int
    loss: float
    psnr: float
    seconds: float
