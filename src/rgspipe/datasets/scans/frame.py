"""What every layout is read into: photographs with their cameras, and the depth that belongs to them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rgspipe.scene.pinhole import Pinhole

Numbers = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Lens(Pinhole):
    """A pinhole in front of which lines may bend.

    Attributes:
        radial: k1, k2, …: a point at distance r from the axis (at depth 1) is seen 1 + k1 r² + k2 r⁴ + … as far out.
        tangential: p1, p2 of Brown's model, as OpenCV and COLMAP have them.
        fisheye: whether r is the angle from the axis instead, as far out as which an undistorted point is seen.
        rational: k4, k5, k6 of OpenCV's model: by 1 + k4 r² + k5 r⁴ + k6 r⁶ that is divided.
    """

    radial: tuple[float, ...] = ()
    tangential: tuple[float, float] = (0.0, 0.0)
    fisheye: bool = False
    rational: tuple[float, ...] = ()

    @property
    def bends(self) -> bool:
        """Whether straight lines do not stay straight."""
        return self.fisheye or any((*self.radial, *self.tangential, *self.rational))

    def places(self, x: Numbers, y: Numbers) -> tuple[Numbers, Numbers]:
        """Columns and rows where rays (x right, y down, 1 forward) land in the image."""
        squared = x**2 + y**2
        angle = np.arctan(np.sqrt(squared)) ** 2 if self.fisheye else squared
        with np.errstate(divide="ignore", invalid="ignore"):  # beyond what such a lens shows
            factor = _series(self.radial, angle) / _series(self.rational, angle)
        if self.fisheye:
            radius = np.sqrt(squared)
            factor = factor * np.divide(np.arctan(radius), radius, out=np.ones_like(radius), where=radius > 0.0)
        p1, p2 = self.tangential
        bent_x = x * factor + 2.0 * p1 * x * y + p2 * (squared + 2.0 * x**2)
        bent_y = y * factor + p1 * (squared + 2.0 * y**2) + 2.0 * p2 * x * y
        return self.fx * bent_x + self.cx, self.fy * bent_y + self.cy


def _series(coefficients: tuple[float, ...], squared: Numbers) -> Numbers:
    """1 + k1 r² + k2 r⁴ + …"""
    factor, power = np.ones_like(squared), np.ones_like(squared)
    for coefficient in coefficients:
        power = power * squared
        factor = factor + coefficient * power
    return factor


@dataclass(frozen=True, eq=False)
class DepthImage:
    """A depth image of a photograph.

    Attributes:
        path: PNG (16 bits), EXR, an array of numpy, or COLMAP's binary array.
        unit: what a stored 1 is, in the unit of the cameras' places.
        lens: its own, where it is not the photograph's at another size.
        confidence: an image of the same size that is 0 where depth is not to be believed.
        disparity: scale and offset by which levels over 65536 become 1 over the depth, if they do.
    """

    path: Path
    unit: float
    lens: Lens | None = None
    confidence: Path | None = None
    disparity: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class ScanFrame:
    """One photograph.

    Attributes:
        image: PNG, JPEG or EXR.
        lens: of the image; its size is that which intrinsics were stated for.
        pose: (4, 4) float64 rigid camera-to-world transform, OpenGL axes.
        depth: measured or predicted, if there is any.
        albedo: a predicted map, if there is one.
        material: an image whose green channel is the part of the albedo that is a metal's and not diffuse.
        mask: an image that is 0 where the photograph is not to be used.
        lighting: the name of the capture, where there are several.
        border: part of the image's longer side along its rim that is not to be used.
        size_stated: whether the layout states the size of `lens`, which else is that of the image as it is stored.
    """

    image: Path
    lens: Lens
    pose: Numbers
    depth: DepthImage | None = None
    albedo: Path | None = None
    material: Path | None = None
    mask: Path | None = None
    lighting: str = ""
    border: float = 0.0
    size_stated: bool = False

    @property
    def files(self) -> list[Path]:
        """All images of the frame."""
        depth = [] if self.depth is None else [self.depth.path, self.depth.confidence]
        return [path for path in (self.image, *depth, self.albedo, self.material, self.mask) if path is not None]


@dataclass(frozen=True, eq=False)
class Scan:
    """A capture as its files describe it; nothing but the cameras has been read.

    Attributes:
        layout: its name.
        stated: the file or folder that states the poses, for errors.
        sources: files beside the frames' that were read.
        frames: in the order of the capture.
        axes: of the cameras in the files, as they were read: "opengl" or "opencv".
        notes: what people should know of what was assumed.
    """

    layout: str
    stated: Path
    sources: tuple[Path, ...]
    frames: tuple[ScanFrame, ...]
    axes: str
    notes: tuple[str, ...] = ()

    def joined(self, other: Scan, lighting: str) -> Scan:
        """With the frames of another capture of the same room."""
        frames = tuple(replace(frame, lighting=lighting) for frame in other.frames)
        return replace(self, sources=self.sources + other.sources, frames=self.frames + frames)

    def thinned(self, most: int) -> Scan:
        """At most so many of the frames, evenly spaced, the first and the last among them."""
        count = len(self.frames)
        chosen = sorted({round(place) for place in np.linspace(0, count - 1, min(count, most))})
        return replace(self, frames=tuple(self.frames[index] for index in chosen))
