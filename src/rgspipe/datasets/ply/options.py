"""What a PLY file from elsewhere leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rgspipe.errors import InputError
from rgspipe.options import Options, option

#: Which side of a surfel is its front; see PlyOptions.
Fronts = Literal["auto", "kept", "inwards", "outwards", "cameras"]


@dataclass(frozen=True)
class PlyOptions(Options):
    """How PLY files from elsewhere are read; those of this program say all of it themselves."""

    fronts: Fronts = "auto"
    """side of the surfels that light falls on: as the rotations say, towards the middle (rooms), away from it
    (objects), or towards the cameras of the images; auto: the latter where a 3DGS folder names them, else as kept"""
    cameras: Path | None = None
    """cameras.json of a 3DGS model, or a transforms file; by default the model's own"""
    srgb: bool = True
    """colours of Gaussians are display values, not linear ones"""
    low: float | None = option(None, low=0, high=1)
    """raw coverage that counts as none; by default what suits the file"""
    high: float | None = option(None, low=0, high=1)
    """raw coverage that is opaque; by default what suits the file"""
    layer: float = option(1.0, low=0.01, high=100)
    """thickness of a layer in the median scale of the surfels"""
    minimum_alpha: float = option(0.01, low=1e-4, high=0.5)
    """opacity below which a surfel is not there"""
    gloss: bool = False
    """take over the gloss of RadiosityGS; fits pass over it, and it takes memory"""
    crop: tuple[float, float, float, float, float, float] | None = option(None, low=-1e6, high=1e6)
    """box that is kept: lower and upper x, y, z in [x,y,z,x,y,z]"""
    max_surfels: int = option(100_000, low=2, high=100_000_000)
    """files with more are refused: operators grow with them"""

    def check(self) -> None:
        """Refuse thresholds and corners in the wrong order."""
        if self.low is not None and self.high is not None and self.low >= self.high:
            found = f"{self.low} and {self.high}"
            raise InputError("low", expected="less than high", found=found, remedy="Put them in order.")
        if self.crop is not None and any(a >= b for a, b in zip(self.crop[:3], self.crop[3:], strict=True)):
            expected, found = "a lower and then an upper corner", str(list(self.crop))
            raise InputError("crop", expected=expected, found=found, remedy="Put them in order.")
