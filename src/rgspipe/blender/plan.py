"""Every frame of a dataset, decided before the first one is rendered, so that a killed run can go on."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
import torch

from rgspipe.blender.cameras import MAX_DRAWS, Layout, no_room
from rgspipe.blender.geometry import Geometry
from rgspipe.blender.job import DatasetJob
from rgspipe.blender.models.parameters import BlendFile
from rgspipe.blender.options import ZooParameters
from rgspipe.blender.targets import MIN_LIT_SHARE, is_of_class, lit_share, random_intensity
from rgspipe.scene import Camera, Light, PointLight

log = logging.getLogger(__name__)

#: Lights that are tried for one view.
MAX_LIGHTS = 50

#: Numbers of the random streams; part of the seed, so never renumber them.
STREAMS = {"train": 0, "test": 1, "visible": 2, "out_of_frame": 3, "occluded": 4, "around_corner": 5, "lamps": 6}

#: Least distance of two lamps that are on together, in parts of the scene's longest side.
LAMPS_APART = 0.25


@dataclass(frozen=True)
class Frame:
    """One image to render.

    Attributes:
        name: path of the image below the dataset's folder, without suffix.
        camera: the camera, square pixels.
        lights: all that are on.
        seed: of Cycles.
        has_surfaces: whether depth, normal and albedo are wanted, too.
        samples: Cycles samples a pixel; those of the job if None.
    """

    name: str
    camera: Camera
    lights: tuple[Light, ...]
    seed: int
    has_surfaces: bool
    samples: int | None = None


@dataclass(frozen=True)
class TargetPlan:
    """A fit target: the frames share one light."""

    name: str
    occlusion: str
    frames: tuple[Frame, ...]


@dataclass(frozen=True)
class Plan:
    """All frames of a dataset, in the order in which they are rendered.

    Attributes:
        lamps: those that are on in all training views, if their lights are to be unknown.
    """

    train: tuple[Frame, ...]
    test: tuple[Frame, ...]
    targets: tuple[TargetPlan, ...]
    lamps: tuple[PointLight, ...] = ()

    @property
    def frames(self) -> list[Frame]:
        """Every image to render, those of the targets last."""
        return [*self.train, *self.test, *(frame for target in self.targets for frame in target.frames)]


def make_plan(job: DatasetJob, layout: Layout, geometry: Geometry) -> Plan:
    """Draw all cameras and lights of `job`.

    Raises:
        InputError: the scene has no room for a camera or a light.
    """
    lamps = () if job.lamps_known else _lamps(job, layout, geometry)
    train = tuple(_view(job, layout, geometry, "train", index, lamps) for index in range(job.train_views))
    test = tuple(_view(job, layout, geometry, "test", index) for index in range(job.test_views))
    cameras = layout.target_cameras()
    targets = [target for occlusion in layout.classes for target in _targets(job, layout, geometry, cameras, occlusion)]
    return Plan(train, test, tuple(targets), lamps)


def _lamps(job: DatasetJob, layout: Layout, geometry: Geometry) -> tuple[PointLight, ...]:
    """The lamps that were on when all training views were taken, none next to another.

    Raises:
        InputError: the scene has no room for so many.
    """
    rng = np.random.default_rng([job.seed, STREAMS["lamps"]])
    apart = LAMPS_APART * float((geometry.hi - geometry.lo).max())
    places: list[np.ndarray] = []
    for _ in range(MAX_DRAWS // 4):
        place = layout.light(rng, job.light_clearance)
        if all(np.linalg.norm(place - other) >= apart for other in places):
            places.append(place)
        if len(places) == job.lamps:
            return tuple(_light(place, random_intensity(rng)) for place in places)
    raise no_room(f"{job.lamps} lamps that are apart")


def _view(
    job: DatasetJob,
    layout: Layout,
    geometry: Geometry,
    split: str,
    index: int,
    lamps: tuple[PointLight, ...] = (),
) -> Frame:
    """A view under a light of its own, or under `lamps` if there are any."""
    rng = np.random.default_rng([job.seed, STREAMS[split], index])
    camera = layout.camera(rng, index)
    position = _view_light(job, layout, geometry, camera, rng)
    lights = lamps or (_light(position, np.full(3, rng.uniform(0.75, 1.3))),)
    samples = job.test_samples if split == "test" else None
    return Frame(f"{split}/r_{index:04d}", camera, lights, int(rng.integers(2**31 - 1)), True, samples)


def _view_light(
    job: DatasetJob, layout: Layout, geometry: Geometry, camera: Camera, rng: np.random.Generator
) -> np.ndarray:
    """A light that the view shows something of."""
    for _ in range(MAX_LIGHTS):
        position = layout.light(rng, job.light_clearance)
        if layout.is_lit_everywhere or lit_share(position, camera, geometry) >= MIN_LIT_SHARE:
            break
    return position


def _targets(
    job: DatasetJob, layout: Layout, geometry: Geometry, cameras: list[Camera], occlusion: str
) -> list[TargetPlan]:
    """The targets of one class: all that are wanted, or as many as a scene that is not ours to choose has room for."""
    targets: list[TargetPlan] = []
    for index in range(job.targets_per_class):
        rng = np.random.default_rng([job.seed, STREAMS[occlusion], index])
        position = _find(job, layout, geometry, cameras, occlusion, rng)
        if position is None:
            if not isinstance(job.model, BlendFile | ZooParameters):
                raise no_room(f"a light of the class {occlusion}")
            log.warning("The scene has no place for a light of the class %s: no such targets.", occlusion)
            return targets
        light = _light(position, random_intensity(rng))
        name = f"{occlusion}_{index:03d}"
        frames = tuple(
            Frame(f"targets/{name}/view_{number}", camera, (light,), int(rng.integers(2**31 - 1)), False)
            for number, camera in enumerate(cameras[: job.target_views])
        )
        targets.append(TargetPlan(name, occlusion, frames))
    return targets


def _find(
    job: DatasetJob,
    layout: Layout,
    geometry: Geometry,
    cameras: list[Camera],
    occlusion: str,
    rng: np.random.Generator,
) -> np.ndarray | None:
    """A light position of the wanted class; None if there seems to be none."""
    for _ in range(MAX_DRAWS // 4):
        if occlusion == "occluded":
            point = layout.hidden_light(rng, job.hidden_light_clearance)
        else:
            point = layout.light(rng, job.light_clearance)
        if is_of_class(point, occlusion, layout.classes, cameras, geometry):
            return point
    return None


def _light(position: np.ndarray, intensity: np.ndarray) -> PointLight:
    return PointLight(torch.as_tensor(position), torch.as_tensor(intensity))
