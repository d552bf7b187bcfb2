"""An analytic ray caster: axis-aligned or turned boxes, seen from inside or outside, as views with depth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.scene import Camera, look_at


@dataclass(frozen=True)
class Cuboid:
    """A box turned about +z; `room` is seen from inside."""

    center: tuple[float, float, float]
    size: tuple[float, float, float]
    turn: float = 0.0
    room: bool = False

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) rows are the box's axes in the world."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def local(self, points: np.ndarray) -> np.ndarray:
        """Points in the box's own axes, where it reaches from −size/2 to size/2."""
        return (points - np.array(self.center)) @ self.axes.T


ROOM = Cuboid((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), room=True)
BLOCK = Cuboid((-0.1, 0.1, -0.3), (0.3, 0.3, 0.4), turn=0.3)


def cast(boxes: list[Cuboid], origin: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (M,), inf without a hit, and facing normal (M, 3) of the nearest surface."""
    best = np.full(len(directions), np.inf)
    normals = np.zeros_like(directions)
    for box in boxes:
        o, d = box.local(origin[None])[0], directions @ box.axes.T
        half = 0.5 * np.array(box.size)
        inverse = 1.0 / np.where(np.abs(d) < 1e-15, 1e-15, d)
        enter, leave = np.sort(np.stack([(-half - o) * inverse, (half - o) * inverse]), axis=0)
        axis = leave.argmin(axis=1) if box.room else enter.argmax(axis=1)
        first, last = enter.max(axis=1), leave.min(axis=1)
        t = last if box.room else first
        hit = (first < last) & (t > 1e-9) & (t < best)
        facing = -np.sign(np.take_along_axis(d, axis[:, None], 1)) * box.axes[axis]
        best, normals = np.where(hit, t, best), np.where(hit[:, None], facing, normals)
    return best, normals


def view_of(
    boxes: list[Cuboid],
    origin: tuple[float, float, float],
    target: tuple[float, float, float],
    resolution: int = 64,
    angle: float = 1.2,
    normals: bool = False,
    name: str = "train/r_0001",
) -> View:
    """A black image with the true planar depth, float32 as from a file, and the true normals if asked for."""
    matrix = look_at(torch.tensor(origin), torch.tensor(target))
    camera = Camera.from_field_of_view(matrix, angle, resolution, resolution)
    _, directions, lengths = camera.rays()
    distance, facing = cast(boxes, camera.origin.numpy(), directions.numpy())
    shape = (resolution, resolution)
    depth = torch.from_numpy(distance / lengths.numpy()).float().reshape(shape)
    return View(
        name=name,
        camera=camera,
        image=torch.zeros(*shape, 3),
        alpha=torch.isfinite(depth).float(),
        depth=depth,
        normal=torch.from_numpy(facing).float().reshape(*shape, 3) if normals else None,
    )


def room_views(
    count: int, resolution: int = 64, normals: bool = False, seed: int = 0, angle: float = 1.4
) -> list[View]:
    """Views of a block in a closed room, from all around inside the room."""
    rng = np.random.default_rng(seed)
    views = []
    while len(views) < count:
        origin, target = rng.uniform(-0.45, 0.45, 3), rng.uniform(-0.3, 0.3, 3)
        if (np.abs(BLOCK.local(origin)) < 0.5 * np.array(BLOCK.size) + 0.03).all():
            continue
        name = f"train/r_{len(views):04d}"
        views.append(view_of([ROOM, BLOCK], tuple(origin), tuple(target), resolution, angle, normals, name))
    return views


def surface_distance(points: np.ndarray, boxes: tuple[Cuboid, ...] = (ROOM, BLOCK)) -> np.ndarray:
    """(M,) distance of the points to the nearest face."""
    distances = []
    for box in boxes:
        beyond = np.abs(box.local(points)) - 0.5 * np.array(box.size)
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        distances.append(np.where(outside > 0, outside, -beyond.max(axis=1)))
    return np.min(distances, axis=0)
