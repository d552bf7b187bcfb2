"""Where the cameras and the lights of a dataset are: seeded draws from the free space of a scene."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch

from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.geometry import FreeSpace, sphere_points
from rgspipe.errors import InputError
from rgspipe.scene import Camera, look_at

#: Draws after which a place that meets all conditions is taken to be impossible.
MAX_DRAWS = 20_000

#: The look-at point and the origins of the cameras in front of the Cornell box, and their field of view [rad].
CORNELL_FOCUS = (0.0, 0.0, -0.12)
CORNELL_TARGET_CAMERAS = ((0.0, -1.5, 0.05), (-0.35, -1.2, 0.25), (0.35, -1.2, 0.25))
CORNELL_TARGET_ANGLE = math.radians(38.0)

#: Classes of fit targets that any scene may have.
USUAL_CLASSES = ("visible", "out_of_frame", "occluded")


class Layout(Protocol):
    """Draws the cameras and lights that suit a kind of scene.

    Attributes:
        classes: of fit targets that suit it.
        is_lit_everywhere: light gets into every view, so that no view's light need be chosen for it.
    """

    classes: tuple[str, ...]
    is_lit_everywhere: bool

    def camera(self, rng: np.random.Generator, index: int) -> Camera:
        """The camera of view `index` of a split."""

    def light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        """(3,) a light position at least `clearance` from any surface."""

    def hidden_light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        """The same, where it may be behind something."""

    def target_cameras(self) -> list[Camera]:
        """The three fixed cameras that see every fit target."""


@dataclass(frozen=True)
class CornellLayout:
    """The Cornell box: one view in five from outside its open front, the others inside, in all directions."""

    space: FreeSpace
    resolution: int
    classes: tuple[str, ...] = USUAL_CLASSES
    is_lit_everywhere: bool = True

    @property
    def _size(self) -> np.ndarray:
        """(3,) width, depth and height of the room."""
        return self.space.geometry.hi - self.space.geometry.lo

    def camera(self, rng: np.random.Generator, index: int) -> Camera:
        size = self._size
        if index % 5 == 0:
            origin = np.array([rng.uniform(-0.4, 0.4), 0.0, rng.uniform(-0.4, 0.4)]) * size
            origin[1] = -0.5 * size[1] - rng.uniform(0.7, 1.2)
            return aimed(origin, rng.uniform(-0.15, 0.15, 3), rng.uniform(45.0, 58.0), self.resolution)
        for _ in range(MAX_DRAWS):
            origin, focus = self.light(rng, 0.06), rng.uniform(-0.45, 0.45, 3) * size
            view = focus - origin
            length = float(np.linalg.norm(view))
            looks_out = view[1] < -0.7 * length
            if length > 0.45 * size.min() and not looks_out:
                return aimed(origin, focus, rng.uniform(75.0, 105.0), self.resolution)
        raise no_room("a camera inside the room")

    def light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        half = 0.5 * self._size
        return free_place(self.space, clearance, lambda: rng.uniform(clearance - half, half - clearance))

    def hidden_light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        return self.light(rng, clearance)

    def target_cameras(self) -> list[Camera]:
        angle = math.degrees(CORNELL_TARGET_ANGLE)
        origins = (np.array(origin) for origin in CORNELL_TARGET_CAMERAS)
        return [aimed(origin, np.array(CORNELL_FOCUS), angle, self.resolution) for origin in origins]


@dataclass(frozen=True)
class RoomLayout:
    """Any scene with an inside: cameras and lights stand in it.

    Attributes:
        fixed: the target cameras; by default some that see much of the room are looked for.
        sight: least distance between a camera and what it looks at, scene units.
    """

    space: FreeSpace
    resolution: int
    classes: tuple[str, ...] = USUAL_CLASSES
    fixed: tuple[FixedView, ...] = ()
    sight: float = 0.25
    is_lit_everywhere: bool = False

    def camera(self, rng: np.random.Generator, index: int) -> Camera:
        for _ in range(MAX_DRAWS):
            origin = self.light(rng, 0.04)
            direction = sphere_points(256)[rng.integers(256)]
            distance, is_front = self.space.geometry.cast(origin, direction)
            if abs(direction[2]) < 0.8 and is_front and np.isfinite(distance) and distance > self.sight:
                return aimed(origin, origin + direction, rng.uniform(75.0, 105.0), self.resolution)
        raise no_room(f"a camera with a view of {self.sight:g} or more")

    def light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        interior, cell = self.space.interior, self.space.cell
        return free_place(
            self.space,
            clearance,
            lambda: interior[rng.integers(len(interior))] + rng.uniform(-0.5, 0.5, 3) * cell,
        )

    def hidden_light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        return self.light(rng, clearance)

    def target_cameras(self) -> list[Camera]:
        if not self.fixed:
            return self._overview()
        return [aimed(np.array(v.origin), np.array(v.focus), v.degrees, self.resolution) for v in self.fixed]

    def _overview(self) -> list[Camera]:
        """The place from which most of the room is in sight, and two beside it.

        All look from one side, so that some of the room is in no frame.
        """
        rng = np.random.default_rng(0)
        interior = self.space.interior
        focus = interior.mean(axis=0)
        probes = interior[rng.integers(len(interior), size=150)]
        origins = np.array([self.light(rng, 0.04) for _ in range(100)])
        origins = origins[np.linalg.norm(origins - focus, axis=1) > 0.1]
        seen = [sum(not self.space.geometry.blocked(origin, probe) for probe in probes) for origin in origins]
        distance = np.linalg.norm(origins - focus, axis=1)
        ranked = origins[np.argsort(-np.array(seen) * (0.3 + distance))]
        beside = ranked[1:][np.argsort(np.linalg.norm(ranked[1:] - ranked[0], axis=1))]
        for apart in (0.15, 0.05, 0.0):
            chosen = [ranked[0]]
            for origin in beside:
                if all(np.linalg.norm(origin - other) > apart for other in chosen):
                    chosen.append(origin)
                if len(chosen) == 3:
                    return [aimed(origin, focus, 70.0, self.resolution) for origin in chosen]
        raise no_room("three target cameras")


@dataclass(frozen=True)
class ObjectLayout:
    """An object in empty space: cameras in a shell around it, lights in a wider one.

    Attributes:
        distances: inner and outer radius of the cameras' shell, in radii of the object.
        lowest_view: least height of a camera over its distance; −1 is straight below.
        nearest_light: inner radius of the lights' shell, in radii of the object; the outer one is 2.
        lowest_light: least height of a light over its distance.
        hidden_reach: how far away lights may be hidden, in radii of the object.
        target_slope: height of the target cameras over their distance from the vertical axis.
    """

    space: FreeSpace
    resolution: int
    classes: tuple[str, ...] = USUAL_CLASSES
    distances: tuple[float, float] = (2.6, 3.2)
    lowest_view: float = -0.3
    nearest_light: float = 0.0
    lowest_light: float = -1.0
    hidden_reach: float = 2.0
    target_slope: float = 0.35
    is_lit_everywhere: bool = False

    @property
    def _radius(self) -> float:
        geometry = self.space.geometry
        return 0.5 * float(np.linalg.norm(geometry.hi - geometry.lo))

    def camera(self, rng: np.random.Generator, index: int) -> Camera:
        direction = rng.normal(size=3)
        direction[2] = max(direction[2], self.lowest_view * float(np.linalg.norm(direction)))
        origin = direction / np.linalg.norm(direction) * self._radius * rng.uniform(*self.distances)
        focus = rng.uniform(-0.1, 0.1, 3)
        return aimed(origin, focus, rng.uniform(40.0, 50.0), self.resolution)

    def light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        return self._place(rng, clearance, self.nearest_light, 2.0)

    def hidden_light(self, rng: np.random.Generator, clearance: float) -> np.ndarray:
        return self._place(rng, clearance, 0.0, self.hidden_reach)

    def _place(self, rng: np.random.Generator, clearance: float, inner: float, outer: float) -> np.ndarray:
        """A place between two radii, in radii of the object."""
        radius = self._radius

        def is_good(point: np.ndarray) -> bool:
            distance = np.linalg.norm(point)
            return inner * radius <= distance < outer * radius and point[2] >= self.lowest_light * distance

        return free_place(self.space, clearance, lambda: rng.uniform(-outer, outer, 3) * radius, is_good)

    def target_cameras(self) -> list[Camera]:
        cameras = []
        for azimuth in (0.0, -0.6, 0.6):
            direction = np.array([math.sin(azimuth), -math.cos(azimuth), self.target_slope])
            origin = (self.distances[1] - 0.2) * self._radius * direction
            cameras.append(aimed(origin, np.zeros(3), 40.0, self.resolution))
        return cameras


def free_place(
    space: FreeSpace,
    clearance: float,
    draw: Callable[[], np.ndarray],
    is_good: Callable[[np.ndarray], bool] = lambda _: True,
) -> np.ndarray:
    """The first of the points (3,) drawn that is good and has no surface within `clearance`.

    Raises:
        InputError: there is none in `MAX_DRAWS`.
    """
    for _ in range(MAX_DRAWS):
        point = draw()
        if is_good(point) and space.has_room_for(point, clearance):
            return point
    raise no_room(f"a place {clearance:g} from any surface")


def aimed(origin: np.ndarray, focus: np.ndarray, degrees: float, resolution: int) -> Camera:
    """A square camera at `origin` that looks at `focus`, `degrees` across."""
    pose = look_at(torch.as_tensor(origin, dtype=torch.float64), torch.as_tensor(focus, dtype=torch.float64))
    return Camera.from_field_of_view(pose, math.radians(degrees), resolution, resolution)


def no_room(what: str) -> InputError:
    """The scene has no place for what is wanted."""
    return InputError(
        "scene",
        expected=f"room for {what}",
        found=f"none in {MAX_DRAWS} draws",
        remedy="Use smaller boxes, a smaller clearance, or a scene with more free space.",
    )
