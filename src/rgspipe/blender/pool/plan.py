"""Every light of a pool, decided before the first image is rendered, so that a killed run can go on."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from rgspipe.blender.cameras import MAX_DRAWS, Layout, no_room
from rgspipe.blender.geometry import Geometry
from rgspipe.blender.models.parameters import BlendFile
from rgspipe.blender.plan import Frame
from rgspipe.blender.pool.aim import aim_at_relay, aim_at_seen, seen_points
from rgspipe.blender.pool.cameras import pool_cameras
from rgspipe.blender.pool.drive import headlights
from rgspipe.blender.pool.job import PoolJob
from rgspipe.blender.targets import classify, is_around_corner, is_of_class
from rgspipe.scene import Camera, Light
from rgspipe.scene.lights import AxialLight, SphereLight
from rgspipe.scene.models import Corridor

log = logging.getLogger(__name__)

#: Numbers of the random streams; part of the seed, so never renumber them.
STREAMS = {"points": 10, "spots": 11, "drive": 12, "spheres": 13, "panels": 14, "suns": 15, "leds": 16, "profiles": 17}

#: Suns are seen, hidden and in frames as a point so many times the scene's diagonal away is: rays of Blender's tree
#: are in float32, and from farther away miss the place that they are to end at.
SUN_DISTANCE = 30.0


@dataclass(frozen=True)
class LightPlan:
    """One light of a pool.

    Attributes:
        name: folder of its images below that of the pool.
        occlusion: its class; "unknown" if it belongs to none.
        light: 1 W/sr, on its axis if it has one.
        frames: one image for each camera.
    """

    name: str
    occlusion: str
    light: Light
    frames: tuple[Frame, ...]


@dataclass(frozen=True)
class _Place:
    """What is asked about a place for a light."""

    job: PoolJob
    layout: Layout
    geometry: Geometry
    cameras: list[Camera]
    seen: np.ndarray


def make_plan(job: PoolJob, layout: Layout, geometry: Geometry) -> list[LightPlan]:
    """Draw all lights of `job`; its cameras are the first of those that `pool_cameras` has.

    Raises:
        InputError: the scene has no room for a light of a class that suits it, or none of the classes suits it.
    """
    cameras = pool_cameras(layout, job.views, job.cameras)
    place = _Place(job, layout, geometry, cameras, seen_points(cameras[0], geometry))
    lights = _drive(place) if job.kind == "drive" else _drawn(place)
    return [_plan(job, cameras, index, *light) for index, light in lights]


def _plan(job: PoolJob, cameras: list[Camera], index: int, occlusion: str, light: Light) -> LightPlan:
    rng = np.random.default_rng([job.dataset.seed, STREAMS[job.kind], index, 1])
    name = f"light_{index:04d}"
    frames = tuple(
        Frame(f"{name}/view_{number}", camera, (light,), int(rng.integers(2**31 - 1)), False)
        for number, camera in enumerate(cameras[: job.views])
    )
    return LightPlan(name, occlusion, light, frames)


def _drive(place: _Place) -> list[tuple[int, tuple[str, Light]]]:
    corridor = place.job.dataset.model
    if not isinstance(corridor, Corridor):
        raise ValueError("a drive leads around the corner of a corridor")
    shape = place.job.spot.least
    pairs = headlights(corridor, place.job.number, shape)
    lights = [light for pair in pairs for light in pair]
    return list(enumerate((_class_of(place, light.position.numpy()), light) for light in lights))


def _drawn(place: _Place) -> list[tuple[int, tuple[str, Light]]]:
    """Lights of each class in turn; a user's scene may have no place for some classes, and suns have none for most."""
    job = place.job
    classes = [name for name in job.classes if name in place.layout.classes]
    drawn: list[tuple[int, tuple[str, Light]]] = []
    missing: set[str] = set()
    for index in range(job.number if classes else 0):
        occlusion = classes[index % len(classes)]
        light = None if occlusion in missing else _draw(place, occlusion, index)
        if light is not None:
            drawn.append((index, (occlusion, light)))
        elif not (isinstance(job.dataset.model, BlendFile) or job.kind == "suns"):
            raise no_room(f"a light of the class {occlusion}")
        elif occlusion not in missing:
            missing.add(occlusion)
            log.warning("The scene has no place for a light of the class %s.", occlusion)
    if not drawn:
        raise no_room(f"a light of the classes {', '.join(job.classes)}")
    return drawn


def _draw(place: _Place, occlusion: str, index: int) -> Light | None:
    """A light of the wanted class; None if there seems to be no place for one."""
    job = place.job
    rng = np.random.default_rng([job.dataset.seed, STREAMS[job.kind], index, 0])
    for _ in range(MAX_DRAWS // 4):
        light = _placed(place, occlusion, rng, index)
        if light is None or not _is_of_class(place, light, occlusion):
            continue
        shape = job.spot.draw(rng) if job.kind == "spots" else light
        light = _aimed(place, occlusion, shape, light.position, rng) if _needs_aim(shape, job) else light
        if light is not None:
            return light
    return None


def _is_of_class(place: _Place, light: Light, occlusion: str) -> bool:
    return is_of_class(_where(place, light), occlusion, place.layout.classes, place.cameras, place.geometry)


def _where(place: _Place, light: Light) -> np.ndarray:
    """(3,) its place; of a sun one far away."""
    if not light.distant:
        return light.position.numpy()
    low, high = place.geometry.lo, place.geometry.hi
    return 0.5 * (low + high) + light.standing(SUN_DISTANCE * float(np.linalg.norm(high - low))).numpy()


def _needs_aim(light: Light, job: PoolJob) -> bool:
    """Whether nothing says yet where it looks, as a surface that it hangs on does of all but spots."""
    return isinstance(light, AxialLight) and (job.kind == "spots" or not job.lamps.hang(job.kind))


def _placed(place: _Place, occlusion: str, rng: np.random.Generator, index: int) -> Light | None:
    """A light of 1 W/sr somewhere in the scene, or on one of its surfaces; None if it does not fit there."""
    job, lamps = place.job, place.job.lamps
    hidden = occlusion == "occluded"
    clearance = job.dataset.hidden_light_clearance if hidden else job.dataset.light_clearance
    lamp = lamps.draw(rng, job.kind, index)
    if lamp.distant:
        return lamp
    clearance = max(clearance, lamp.radius) if isinstance(lamp, SphereLight) else clearance
    position = (place.layout.hidden_light if hidden else place.layout.light)(rng, clearance)
    if lamps.hang(job.kind):
        return lamps.hung(lamp, position, place.geometry, rng)
    return lamp.at(torch.from_numpy(position))


def _aimed(
    place: _Place, occlusion: str, shape: AxialLight, position: Tensor, rng: np.random.Generator
) -> AxialLight | None:
    """A light like `shape` at `position` (3,) that lights enough; None if it can not be aimed so."""
    at = position.numpy()
    if occlusion == "around_corner":
        axis = aim_at_relay(rng, at, place.seen, place.geometry)
    else:
        axis = aim_at_seen(rng, at, shape, place.seen, place.geometry)
    return None if axis is None else shape.at(position, torch.from_numpy(axis))


def _class_of(place: _Place, position: np.ndarray) -> str:
    classes, geometry = place.layout.classes, place.geometry
    if "around_corner" in classes and is_around_corner(position, place.cameras, geometry):
        return "around_corner"
    return classify(position, place.cameras, geometry.blocked) or "unknown"
