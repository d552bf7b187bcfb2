"""What a pinhole makes of directions: the numbers that belong to an image and change with its size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self


@dataclass(frozen=True)
class Pinhole:
    """Focal lengths and principal point. Pixel (column x, row y) has its centre at (x + 0.5, y + 0.5).

    Attributes:
        fx, fy: focal lengths in pixels.
        cx, cy: principal point in pixels.
        width, height: size in pixels of the images that these belong to.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def resized(self, width: int, height: int) -> Self:
        """The same before images of another size that show the same."""
        across, down = width / self.width, height / self.height
        focal = {"fx": self.fx * across, "fy": self.fy * down, "cx": self.cx * across, "cy": self.cy * down}
        return replace(self, **focal, width=width, height=height)
