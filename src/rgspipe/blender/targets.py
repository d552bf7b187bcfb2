"""The classes of fit targets: lights in sight, out of every frame, hidden behind something, and around a corner."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import torch

from rgspipe.scene import Camera

if TYPE_CHECKING:
    from rgspipe.blender.geometry import Geometry

#: Tells whether a surface lies between two points.
Blocked = Callable[[np.ndarray, np.ndarray], bool]

#: Rays along each side of the image that ask what is lit, and their distance from the surface they ask about.
PROBES = 10
SURFACE_OFFSET = 1e-4

#: Share of what a view shows that its light reaches directly; darker views tell little about their light.
MIN_LIT_SHARE = 0.02

#: A light is around the corner if it reaches at most this share of what any camera sees.
MAX_SHARE_AROUND_CORNER = 0.1


def classify(point: np.ndarray, cameras: list[Camera], blocked: Blocked) -> str | None:
    """The class of a light at `point` (3,), as seen by the fixed cameras.

    `visible`: in the frame of every camera, nothing in between. `out_of_frame`: in no camera's frame.
    `occluded`: behind something for every camera, and inside the first camera's frame. None: mixed.
    """
    framed = [in_frame(camera, point) for camera in cameras]
    if not any(framed):
        return "out_of_frame"
    hidden = [blocked(camera.origin.numpy(), point) for camera in cameras]
    if all(framed) and not any(hidden):
        return "visible"
    if all(hidden) and framed[0]:
        return "occluded"
    return None


def is_of_class(
    point: np.ndarray, wanted: str, classes: tuple[str, ...], cameras: list[Camera], geometry: Geometry
) -> bool:
    """Whether a light at `point` (3,) is of the class `wanted`, and shows enough to be found.

    Where `around_corner` is one of the scene's classes, it comes before all others.
    """
    if "around_corner" in classes and is_around_corner(point, cameras, geometry):
        return wanted == "around_corner"
    is_wanted = classify(point, cameras, geometry.blocked) == wanted
    return is_wanted and lit_share(point, cameras[0], geometry) >= MIN_LIT_SHARE


def is_around_corner(point: np.ndarray, cameras: list[Camera], geometry: Geometry) -> bool:
    """Whether `point` (3,) is in no camera's line of sight, and lights next to nothing of what they see directly."""
    return all(
        geometry.blocked(camera.origin.numpy(), point) and lit_share(point, camera, geometry) <= MAX_SHARE_AROUND_CORNER
        for camera in cameras
    )


def lit_share(point: np.ndarray, camera: Camera, geometry: Geometry) -> float:
    """Share of what `camera` sees of the surfaces that a light at `point` (3,) reaches directly.

    Asked of a regular grid of PROBES × PROBES pixels; 0 if the camera sees no surface.
    """
    step = (torch.arange(PROBES, dtype=torch.float64) + 0.5) / PROBES
    rows, columns = (step * camera.height).long(), (step * camera.width).long()
    _, directions, _ = camera.rays((rows[:, None] * camera.width + columns).reshape(-1))
    origin = camera.origin.numpy()
    lit = []
    for direction in directions.numpy():
        distance, _ = geometry.cast(origin, direction)
        if np.isfinite(distance):
            lit.append(not geometry.blocked(point, origin + direction * (distance - SURFACE_OFFSET)))
    return float(np.mean(lit)) if lit else 0.0


def in_frame(camera: Camera, point: np.ndarray) -> bool:
    """Whether `point` (3,) projects into the image, obstructed or not."""
    pixel, depth = camera.project(torch.as_tensor(point, dtype=torch.float64))
    column, row = pixel.tolist()
    return float(depth) > 0 and 0 <= column < camera.width and 0 <= row < camera.height


def random_intensity(rng: np.random.Generator, base: float = 1.0) -> np.ndarray:
    """(3,) W/sr: each channel exp(U(−0.7, 0.7)) times `base`."""
    return base * np.exp(rng.uniform(-0.7, 0.7, 3))
