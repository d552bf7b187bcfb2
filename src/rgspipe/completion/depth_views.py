"""Where flat surfaces end, as photographs with depth show it.

Of two rays beside an edge one ends on the surface and the other goes past it: the edge is between the places where they
meet its plane. Many photographs have many such pairs, so together they tell it to a small part of a pixel, on neither
side of the truth. Where the last surfel or the last pixel is tells less: that is a bound from within.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from torch import Tensor

from rgspipe.scene import Camera

#: Fewest rays that end on a surface, and as many that go past it, that tell its edge.
FEWEST = 8

#: Part of the rays that may be on the wrong side of an edge, as noise of depth and what stands on a surface put some:
#: with more of them it is none.
STRAYS = 0.1

#: Most pixels of a photograph that are asked about one edge; of more, some are left out evenly.
MOST_PIXELS = 4096


@dataclass(frozen=True)
class Strip:
    """A strip of a plane along a straight edge, in which the edge is looked for.

    Attributes:
        middle: (3,) a place on the plane where the edge may be.
        along, outward, normal: (3,) unit, at right angles: along the edge, past it in the plane, to the plane's front.
        length: (2,) first and last place along the edge, from the middle.
        width: how far from the middle the edge may be, to either side.
    """

    middle: np.ndarray
    along: np.ndarray
    outward: np.ndarray
    normal: np.ndarray
    length: tuple[float, float]
    width: float

    @property
    def corners(self) -> np.ndarray:
        """(4, 3)."""
        ends = [end * self.along + side * self.width * self.outward for end in self.length for side in (-1.0, 1.0)]
        return self.middle + np.array(ends)


@dataclass(frozen=True)
class DepthViews:
    """Photographs with depth.

    Attributes:
        cameras: V of them.
        depths: for each the planar depth (H, W), +inf where there is no surface, NaN where it is not known.
    """

    cameras: tuple[Camera, ...]
    depths: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, cameras: Sequence[Camera], depths: Sequence[Tensor | None]) -> DepthViews:
        """Those of some photographs that have depth."""
        pairs = zip(cameras, depths, strict=True)
        known = [(camera, depth.cpu().numpy()) for camera, depth in pairs if depth is not None]
        return cls(tuple(camera for camera, _ in known), tuple(depth for _, depth in known))

    def edge_in(self, strip: Strip, near: float) -> float | None:
        """How far past the strip's middle its surface ends; None where too few rays tell.

        Args:
            near: rays that end within this of the plane end on the surface.
        """
        if not self.cameras:
            return None
        pairs = [_met(camera, depth, strip, near) for camera, depth in zip(self.cameras, self.depths, strict=True)]
        past, ended = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
        if min(ended.sum(), (~ended).sum()) < FEWEST:
            return None
        order = np.argsort(past, kind="stable")
        past, ended = past[order], ended[order]
        # Rays on the wrong side of an edge behind the first k places: those before it that went past, and those after
        # it that ended on the surface.
        wrong = np.concatenate([[0], np.cumsum(~ended)]) + np.concatenate([np.cumsum(ended[::-1])[::-1], [0]])
        best = np.flatnonzero(wrong == wrong.min())
        place = int(best[len(best) // 2])
        if not 0 < place < len(past) or wrong[place] > STRAYS * min(ended.sum(), (~ended).sum()):
            return None
        return float(0.5 * (past[place - 1] + past[place]))


def _met(camera: Camera, depth: np.ndarray, strip: Strip, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Of rays that meet the strip from its front how far past its middle (R,), and whether they end there (R,)."""
    pose = camera.camera_to_world.double().cpu().numpy()
    rotation, origin = pose[:3, :3], pose[:3, 3]
    height = float((origin - strip.middle) @ strip.normal)
    local = (strip.corners - origin) @ rotation
    nothing = np.empty(0), np.empty(0, dtype=bool)
    if height <= near or (local[:, 2] >= 0.0).any():
        return nothing
    u, v = camera.cx - camera.fx * local[:, 0] / local[:, 2], camera.cy + camera.fy * local[:, 1] / local[:, 2]
    columns = np.arange(max(int(u.min()), 0), min(int(np.ceil(u.max())), camera.width))
    rows = np.arange(max(int(v.min()), 0), min(int(np.ceil(v.max())), camera.height))
    if not len(columns) or not len(rows):
        return nothing
    every = max(1, int(np.ceil(np.sqrt(len(columns) * len(rows) / MOST_PIXELS))))
    column, row = (part.reshape(-1) for part in np.meshgrid(columns[::every], rows[::every]))
    across, down = (column + 0.5 - camera.cx) / camera.fx, (row + 0.5 - camera.cy) / camera.fy
    # Of planar depth 1, so that depths are lengths along them.
    rays = np.stack([across, -down, -np.ones(len(across))], axis=1) @ rotation.T
    measured, towards = depth[row, column].astype(np.float64), -(rays @ strip.normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = height / towards
        place = origin + reach[:, None] * rays - strip.middle
        behind = np.where(np.isinf(measured), np.inf, (measured - reach) * towards)
    along, past = place @ strip.along, place @ strip.outward
    meets = (towards > 0.0) & (along > strip.length[0]) & (along < strip.length[1]) & (np.abs(past) < strip.width)
    # What ends before the plane tells nothing of it.
    meets &= behind > -near
    return past[meets], behind[meets] < near
