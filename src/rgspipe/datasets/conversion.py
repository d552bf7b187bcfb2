"""What a conversion between formats could not keep, in words and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from rgspipe.store.files import write_json

VERSION = 1


@dataclass(frozen=True)
class Loss:
    """Something that the other format cannot represent.

    Attributes:
        what: in words, with what was done instead.
        surfels: how many it concerns.
        largest: the largest loss of one of them.
        measure: what `largest` measures, with its unit.
    """

    what: str
    surfels: int
    largest: float
    measure: str


@dataclass(frozen=True)
class Conversion:
    """How a file was read or written.

    Attributes:
        path: the file.
        layout: its format, in words.
        surfels: how many came through.
        losses: what could not be kept; those of no surfel are left out.
        notes: what was assumed.
    """

    path: str
    layout: str
    surfels: int
    losses: tuple[Loss, ...]
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls, path: str | Path, layout: str, surfels: int, losses: Sequence[Loss], notes: Sequence[str]
    ) -> Conversion:
        """Only the losses that concern any surfel."""
        return cls(str(path), layout, surfels, tuple(loss for loss in losses if loss.surfels), tuple(notes))

    def lines(self) -> list[str]:
        """The report for people."""
        lines = [f"{self.path}: {self.layout}, {self.surfels} surfels"]
        lines += [f"  {loss.what}: {loss.surfels} surfels, {loss.measure} {loss.largest:.3g}" for loss in self.losses]
        lines += [f"  {note}" for note in self.notes]
        return lines if self.losses or self.notes else [*lines, "  nothing was lost"]

    def save(self, path: Path) -> None:
        """Write the report as JSON."""
        write_json(path, {"version": VERSION, **asdict(self)})


def loss(what: str, size: np.ndarray, threshold: float, measure: str) -> Loss:
    """The loss of the surfels whose `size` (N,) exceeds `threshold`."""
    largest = float(size.max()) if len(size) else 0.0
    return Loss(what, int((size > threshold).sum()), largest, measure)
