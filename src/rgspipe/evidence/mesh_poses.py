"""Whether photographs show a mesh from where they are said to: what one view sees there looks alike in the others.

A view's score is the rank correlation of the brightness of the points that it sees of the mesh with theirs in other
views, for which nothing stands before them. Exposure and response leave ranks alone; gloss and noise blur them, but
favour no other place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import torch

from rgspipe.datasets.mesh.up import UPRIGHT
from rgspipe.datasets.views import View
from rgspipe.evidence.comparison import FEWEST_VIEWS, REMAINDER, clearly_above, plainest
from rgspipe.evidence.readings import FLIP, Numbers
from rgspipe.renderer.kernels.mesh_rays import MeshRays
from rgspipe.scene.mesh import TriangleMesh

#: Views that are looked at, other views that each is compared with, and points of each.
VIEWS, PARTNERS, POINTS = 20, 6, 300

#: Fewer points than this that another view shows, too, are no evidence: a score of 0.
LEAST_SHARED = 30

#: Units of the mesh over those of the poses.
SCALES = (1.0, 0.001, 1000.0, 0.01, 100.0)

#: By what part of the mesh's size rays may end before the point that they are to see.
SLACK = 1e-3


@dataclass(frozen=True)
class MeshReading:
    """What would have to be done to poses and mesh as they were read.

    Attributes:
        opencv: the cameras' axes are OpenCV's.
        inverse: the matrices take the world to the camera.
        turned: the mesh's other axis, of y and z, points up.
        scale: what the mesh is to be multiplied by.
    """

    opencv: bool = False
    inverse: bool = False
    turned: bool = False
    scale: float = 1.0

    @property
    def changes(self) -> int:
        """In how many things it differs from what is stated."""
        return self.opencv + self.inverse + self.turned + (self.scale != 1.0)


READINGS = tuple(
    sorted((MeshReading(*parts) for parts in product(*3 * [(False, True)], SCALES)), key=lambda one: one.changes)
)


@dataclass(frozen=True)
class MeshFinding:
    """How readings do.

    Attributes:
        meant: the plainest that none is clearly better than.
        found, stated: its mean score, and that of the files.
        clear: whether the photographs are clear about either.
    """

    meant: MeshReading
    found: float
    stated: float
    clear: bool

    @property
    def misread(self) -> bool:
        """Whether something else was meant than the files state."""
        return self.clear and self.meant.changes > 0 and 1.0 - self.found <= REMAINDER * (1.0 - self.stated)


def poses_on_mesh(views: Sequence[View], mesh: TriangleMesh, *, y_up: bool, seed: int = 0) -> MeshFinding | None:
    """Which reading the photographs are clear about; None where there are too few to say.

    Args:
        y_up: whether the mesh was turned from y up to z up when it was read.
    """
    if len(views) < FEWEST_VIEWS:
        return None
    trials = _Trials.draw(views, mesh, UPRIGHT if y_up else UPRIGHT.T, seed)
    scores = {reading: trials.scores(reading) for reading in READINGS}
    meant = plainest(scores)
    return MeshFinding(
        meant, float(scores[meant].mean()), float(scores[READINGS[0]].mean()), clearly_above(scores[meant])
    )


@dataclass(frozen=True, eq=False)
class _Trials:
    """Which pixels of which views are compared with which others; the same for every reading.

    Attributes:
        views: V of them.
        logs: of each, (H, W) logarithms of the grey over their mean.
        pixels: (V, POINTS) flat indices.
        partners: (V, ≤ PARTNERS) other views.
        rays: the mesh.
        slack: scene units.
        back: (4, 4) from the mesh's other upright world to the cameras' one.
    """

    views: Sequence[View]
    logs: list[Numbers]
    pixels: np.ndarray
    partners: np.ndarray
    rays: MeshRays
    slack: float
    back: Numbers

    @classmethod
    def draw(cls, views: Sequence[View], mesh: TriangleMesh, back: Numbers, seed: int) -> _Trials:
        rng = np.random.default_rng(seed)
        chosen = [views[i] for i in sorted({round(x) for x in np.linspace(0, len(views) - 1, VIEWS)})]
        count = len(chosen)
        pixels = np.stack([rng.integers(view.camera.pixel_count, size=POINTS) for view in chosen])
        partners = np.array([rng.permutation(np.delete(np.arange(count), i))[:PARTNERS] for i in range(count)])
        logs = [np.log(view.image.mean(dim=2).double().numpy() + 1e-6) for view in chosen]
        logs = [values - values.mean() for values in logs]
        return cls(chosen, logs, pixels, partners, MeshRays(mesh), SLACK * mesh.size, back)

    def scores(self, reading: MeshReading) -> Numbers:
        """(V,) rank correlations."""
        poses = [self._pose(view, reading) for view in self.views]
        return np.array([self._score(index, poses) for index in range(len(self.views))])

    def _pose(self, view: View, reading: MeshReading) -> Numbers:
        """(4, 4) camera-to-world, where the world is that of the mesh as it was read."""
        pose = view.camera.camera_to_world.double().numpy()
        pose = np.linalg.inv(pose) if reading.inverse else pose
        pose = pose @ FLIP if reading.opencv else pose
        pose = (self.back if reading.turned else np.eye(4)) @ pose
        pose[:3, 3] /= reading.scale
        return pose

    def _score(self, index: int, poses: list[Numbers]) -> float:
        from scipy.stats import rankdata  # slow to import

        points, own = self._points(index, poses[index])
        pairs = [self._shared(points, own, other, poses[other]) for other in self.partners[index]]
        here, there = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
        if len(here) < LEAST_SHARED or np.ptp(here) == 0.0 or np.ptp(there) == 0.0:
            return 0.0
        return float(np.corrcoef(rankdata(here), rankdata(there))[0, 1])

    def _points(self, index: int, pose: Numbers) -> tuple[Numbers, Numbers]:
        """Points (M, 3) of the mesh that the view's pixels show, and their brightness (M,)."""
        camera, pixels = self.views[index].camera, self.pixels[index]
        row, column = np.divmod(pixels, camera.width)
        local = np.stack([(column + 0.5 - camera.cx) / camera.fx, -(row + 0.5 - camera.cy) / camera.fy], axis=1)
        directions = np.concatenate([local, -np.ones((len(local), 1))], axis=1) @ pose[:3, :3].T
        origins = np.broadcast_to(pose[:3, 3], directions.shape)
        distance = self.rays.hits(torch.from_numpy(origins.copy()), torch.from_numpy(directions)).distance.numpy()
        met = np.isfinite(distance)
        return (origins + distance[:, None] * directions)[met], self.logs[index].reshape(-1)[pixels[met]]

    def _shared(self, points: Numbers, own: Numbers, other: int, pose: Numbers) -> tuple[Numbers, Numbers]:
        """The brightness of those points (M, 3) that another view shows: in the first view, and in that."""
        camera = self.views[other].camera
        local = (points - pose[:3, 3]) @ pose[:3, :3]
        ahead = np.where(local[:, 2] < 0.0, -local[:, 2], np.nan)
        column = np.floor(camera.cx + camera.fx * local[:, 0] / ahead)
        row = np.floor(camera.cy - camera.fy * local[:, 1] / ahead)
        shown = ((column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)).nonzero()[0]
        origins = torch.from_numpy(np.broadcast_to(pose[:3, 3], (len(shown), 3)).copy())
        shown = shown[self.rays.sees(origins, torch.from_numpy(points[shown]), self.slack).numpy()]
        return own[shown], self.logs[other][row[shown].astype(int), column[shown].astype(int)]
