"""Slices through a fit's loss as a NumPy file: plain arrays, never objects."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

#: The planes that a file holds, by the axes that run across and up.
PLANES = ("xy", "xz", "yz")


@dataclass(frozen=True)
class PlaneLoss:
    """The loss on one plane.

    Attributes:
        across, up: (n,) coordinates, scene units.
        loss: (n, n), rows along `up`; NaN where it is not known.
    """

    across: npt.NDArray[np.float64]
    up: npt.NDArray[np.float64]
    loss: npt.NDArray[np.float64]


@dataclass(frozen=True)
class Landscape:
    """The loss around an answer.

    Attributes:
        planes: one of each of `PLANES`.
        trajectory: (T, 3) positions of the light from the start to the answer, scene units.
    """

    planes: Mapping[str, PlaneLoss]
    trajectory: npt.NDArray[np.float64]


def landscape_bytes(landscape: Landscape) -> bytes:
    """The content of the file."""
    arrays = {"trajectory": landscape.trajectory}
    for name, plane in landscape.planes.items():
        arrays |= {f"{name}_across": plane.across, f"{name}_up": plane.up, f"{name}_loss": plane.loss}
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def read_landscape(path: Path) -> Landscape:
    """What `landscape_bytes` made."""
    with np.load(path, allow_pickle=False) as held:
        planes = {name: PlaneLoss(*(held[f"{name}_{part}"] for part in ("across", "up", "loss"))) for name in PLANES}
        return Landscape(planes, held["trajectory"])
