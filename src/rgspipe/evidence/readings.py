"""How the poses and depths of a capture could have been meant: as its files state, or as other programs write them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.views import View
from rgspipe.scene import Camera

Pixels = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.float64]

#: From OpenGL's camera axes (x right, y up, z backwards) to OpenCV's (x right, y down, z forwards), and back.
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])

#: What depths may have to be multiplied by: as they are; millimetres, centimetres and metres taken for each other; and
#: millimetres and steps of 1/5000 m.
SCALES = (1.0, 0.001, 1000.0, 0.01, 100.0, 0.1, 10.0, 5.0, 0.2)


@dataclass(frozen=True)
class Reading:
    """What would have to be done to poses and depths as they were read.

    Attributes:
        opencv: the cameras' axes are OpenCV's.
        inverse: the matrices take the world to the camera.
        other_depth: depth is of the other convention: along rays instead of along the camera's axis, or the reverse.
        scale: what depths are to be multiplied by.
    """

    opencv: bool = False
    inverse: bool = False
    other_depth: bool = False
    scale: float = 1.0

    @property
    def changes(self) -> int:
        """In how many things it differs from what is stated."""
        return self.opencv + self.inverse + self.other_depth + (self.scale != 1.0)


#: All of them, what is stated first and then by how much they differ from it.
READINGS = tuple(
    sorted((Reading(*parts) for parts in product(*3 * [(False, True)], SCALES)), key=lambda reading: reading.changes)
)


@dataclass(frozen=True, eq=False)
class PlacedView:
    """A view's depth and pose under some reading.

    Attributes:
        camera: its intrinsics; its pose is as the files state it.
        depth: (H, W) float32 planar depth as the files state it; +inf: no surface, NaN: not known.
        pose: (4, 4) camera-to-world, OpenGL axes.
        scale: what depths are multiplied by.
        power: … and that of the length of a pixel's ray one deep.
    """

    camera: Camera
    depth: npt.NDArray[np.float32]
    pose: npt.NDArray[np.float64]
    scale: float
    power: int

    @classmethod
    def of(cls, view: View, reading: Reading, along_rays: bool) -> Self:
        """A view with depth; `along_rays` says whether its files state depth along rays."""
        pose = view.camera.camera_to_world.numpy()
        pose = np.linalg.inv(pose) if reading.inverse else pose
        pose = pose @ FLIP if reading.opencv else pose
        power = (1 if along_rays else -1) if reading.other_depth else 0
        return cls(view.camera, view.depth.numpy(), pose, reading.scale, power)

    def depth_at(self, row: Pixels, column: Pixels) -> Numbers:
        """Planar depth of pixels (…,)."""
        depth = self.scale * self.depth[row, column].astype(np.float64)
        return depth * np.linalg.norm(self._local(row, column), axis=-1) ** self.power if self.power else depth

    def points(self, row: Pixels, column: Pixels) -> Numbers:
        """(N, 3) world points that pixels (N,) show."""
        return self.depth_at(row, column)[:, None] * (self._local(row, column) @ self.pose[:3, :3].T) + self.pose[:3, 3]

    def project(self, points: Numbers) -> tuple[Pixels, Pixels, Numbers]:
        """Row, column and planar depth of points (N, 3); −1 for both where the image does not show them."""
        local = (points - self.pose[:3, 3]) @ self.pose[:3, :3]
        depth, camera = -local[:, 2], self.camera
        ahead = np.where(depth > 0.0, depth, np.nan)
        column = np.floor(camera.cx + camera.fx * local[:, 0] / ahead)
        row = np.floor(camera.cy - camera.fy * local[:, 1] / ahead)
        shown = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
        row, column = (np.where(shown, part, -1.0).astype(np.int64) for part in (row, column))
        return row, column, depth

    def _local(self, row: Pixels, column: Pixels) -> Numbers:
        """(…, 3) directions in the camera's own axes, one long along its axis."""
        camera = self.camera
        across, down = (column + 0.5 - camera.cx) / camera.fx, (row + 0.5 - camera.cy) / camera.fy
        return np.stack([across, -down, -np.ones_like(across)], axis=-1)
