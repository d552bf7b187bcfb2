"""Small files of measured luminaires, and tables."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.scene.lights import Photometry

#: A table by vertical angle (0°, 45°, 90°) of the planes 0°, 90° and 180°.
COLUMNS = ([10.0, 8.0, 0.0], [10.0, 4.0, 1.0], [10.0, 6.0, 2.0])


def ies(
    planes: str = "0 90 180", columns: tuple = COLUMNS, tilt: str = "TILT=NONE", kind: int = 1, more: str = ""
) -> str:
    """A file of LM-63."""
    rows = "\n".join(" ".join(map(str, column)) for column in columns)
    header = f"1 1000 2 3 {len(columns)} {kind} 2 0 0 0\n0.5 1 20"
    return f"IESNA:LM-63-2002\n[TEST] lamp\n{tilt}\n{header}\n0 45 90\n{planes}\n{rows}\n{more}"


def ldt(symmetry: int, planes: int, columns: list[list[float]], flux: float = 2000.0) -> str:
    """A file of EULUMDAT."""
    turns = [f"{360 / planes * k:g}" for k in range(planes)]
    head = ["maker", "1", f"{symmetry}", f"{planes}", f"{360 / planes:g}", "3", "45", "", "lamp", "", "", ""]
    head += ["0"] * 11
    # DFF, LORL, conversion factor, tilt; one set of lamps; direct ratios.
    head[21:] = ["100", "100", "1", "0", "1", "1", "LED", f"{flux:g}", "4000", "80", "20", *["0,5"] * 10]
    return "\r\n".join([*head, *turns, "0", "45", "90", *(f"{value:g}" for column in columns for value in column), ""])


def angles(step: float, last: float) -> Tensor:
    return torch.deg2rad(torch.arange(0.0, last + 1e-9, step, dtype=torch.float64))


def photometry(columns: tuple = COLUMNS, name: str = "") -> Photometry:
    """The table of such a file; its planes are even around the axis."""
    vertical = torch.deg2rad(torch.tensor([0.0, 45.0, 90.0], dtype=torch.float64))
    horizontal = 2.0 * math.pi / len(columns) * torch.arange(len(columns), dtype=torch.float64)
    return Photometry.measured(vertical, horizontal, torch.tensor(columns, dtype=torch.float64).T, name)


def jump() -> Photometry:
    """A beam that ends between two angles, to one side only."""
    vertical, horizontal = angles(5.0, 90.0), angles(90.0, 270.0)
    lit = (vertical[:, None] < 0.5) & (horizontal[None] < 3.0)
    table = torch.where(lit, 1000.0, 1.0).double()
    table[0] = 500.0
    return Photometry.measured(vertical, horizontal, table)
