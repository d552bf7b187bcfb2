"""PLY files as other programs write them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement

#: A grid of flat, opaque, grey Gaussians in the plane z = 0: enough for a spacing.
SIDE = 6


def write_ply(path: Path, columns: Mapping[str, np.ndarray], *, text: bool = False) -> Path:
    """A file with float properties, without comments."""
    data = np.empty(len(next(iter(columns.values()))), dtype=[(name, "f4") for name in columns])
    for name, values in columns.items():
        data[name] = values
    PlyData([PlyElement.describe(data, "vertex")], text=text).write(str(path))
    return path


def _grid() -> dict[str, np.ndarray]:
    x, y = (part.reshape(-1) for part in np.meshgrid(np.arange(SIDE), np.arange(SIDE)))
    return {"x": 0.1 * x, "y": 0.1 * y, "z": 0.0 * x} | dict.fromkeys(("nx", "ny", "nz"), 0.0 * x)


def gaussian_columns(scales: tuple[float, ...] = (0.05, 0.04, 1e-6), opacity: float = 0.9) -> dict[str, np.ndarray]:
    """3DGS: colour ½, no turn, `scales` along x, y and z."""
    columns = _grid()
    zero = np.zeros(SIDE * SIDE)
    columns |= {f"f_dc_{index}": zero for index in range(3)} | {f"f_rest_{index}": zero for index in range(45)}
    columns["opacity"] = zero + np.log(opacity / (1.0 - opacity))
    columns |= {f"scale_{index}": zero + np.log(value) for index, value in enumerate(scales)}
    return columns | {f"rot_{index}": zero + float(index == 0) for index in range(4)}


def radiosity_columns() -> dict[str, np.ndarray]:
    """RadiosityGS: every logit 0, so that each value is half of its range."""
    zero, columns = np.zeros(SIDE * SIDE), _grid()
    names = [f"{group}_{index}" for group in ("s", "b", "ad", "as") for index in range(3)]
    columns |= dict.fromkeys([*names, "geovalue", "norm_factor", "scale_0", "scale_1"], zero)
    return columns | {f"rot_{index}": zero + float(index == 0) for index in range(4)}
