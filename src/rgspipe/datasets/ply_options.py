"""What a PLY file from elsewhere leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

#: Which side of a surfel is its front; see PlyOptions.
Fronts = Literal["auto", "kept", "inwards", "outwards", "cameras"]


@dataclass(frozen=True)
class PlyOptions:
    """How files from elsewhere are read; files of this program say all of it themselves.

    Attributes:
        fronts: `kept` as the rotations say; `inwards` towards the middle of the scene, for rooms; `outwards` away from
            it, for objects in empty space; `cameras` towards the cameras that took the images; `auto` as kept in a file
            of this program, and else towards the cameras that a 3DGS folder names.
        cameras: a 3DGS cameras.json or a transforms file; by default cameras.json beside the file or in its model's
            folder.
        srgb: the colours of Gaussians are display values; False takes them as linear.
        low, high: thresholds of the coverage; None for those that suit the layout.
        layer: thickness of a layer in median scales.
        minimum_alpha: opacity below which a surfel is not there.
        gloss: take over the gloss of RadiosityGS, too; without it only the diffuse part is.
        crop: (x, y, z, x, y, z) lower and upper corner of the box that is kept; None for all.
        max_surfels: files of which more are kept are refused; None for no limit.
    """

    fronts: Fronts = "auto"
    cameras: Path | None = None
    srgb: bool = True
    low: float | None = None
    high: float | None = None
    layer: float = 1.0
    minimum_alpha: float = 0.01
    gloss: bool = True
    crop: tuple[float, ...] | None = None
    max_surfels: int | None = None
