"""What is behind the pixels of a view, as images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Passes:
    """The surfaces behind pixel centres; None for what is not known at all.

    Attributes:
        depth: (H, W) planar; infinite where there is no surface, NaN where it is not known.
        normal: (H, W, 3) unit, towards the camera; 0 where there is no surface.
        albedo: (H, W, 3) linear reflectance; 0 there and where it is not known.
    """

    depth: Pixels | None
    normal: Pixels | None
    albedo: Pixels | None
