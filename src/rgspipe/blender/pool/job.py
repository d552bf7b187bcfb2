"""Which single lights are to be rendered: plain values that travel to Blender's process as JSON."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field

import numpy as np

from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.job import DatasetJob
from rgspipe.blender.pool.lamps import LampRange
from rgspipe.datasets.classes import LIGHT_CLASSES, LightClass
from rgspipe.names import PoolKind, SpotProfile
from rgspipe.scene.lights import SpotLight
from rgspipe.scene.lights.spot_profiles import PROFILES

#: Lights of a car.
HEADLIGHTS = 2


@dataclass(frozen=True)
class SpotRange:
    """Spots' profile, and where its angles are drawn from.

    Attributes:
        profile: as in `SpotLight`.
        cone_angle: least and largest half-angle, rad.
        falloff: least and largest rim, in the units of `SpotLight.falloff`.

    Raises:
        ValueError: an end of a range is no spot, or a rim may have no width.
    """

    profile: SpotProfile = "smoothstep"
    cone_angle: tuple[float, float] = (math.radians(25.0), math.radians(25.0))
    falloff: tuple[float, float] = (0.15, 0.15)

    def __post_init__(self) -> None:
        for low, high in (self.cone_angle, self.falloff):
            if not 0.0 < low <= high:
                raise ValueError(f"a range must be above 0 and in order, got {low} to {high}")
        largest = PROFILES[self.profile].largest_falloff(self.cone_angle[0])
        widest = SpotLight.shaped(self.profile, self.cone_angle[0], self.falloff[1])
        if self.falloff[1] > largest or widest.rim == 0.0:
            raise ValueError(f"a {self.profile} rim must fit its cone and have a width, got {self.falloff[1]:g}")

    @property
    def least(self) -> SpotLight:
        """The narrowest cone with the narrowest rim."""
        return SpotLight.shaped(self.profile, self.cone_angle[0], self.falloff[0])

    def draw(self, rng: np.random.Generator) -> SpotLight:
        """A cone and a rim, each uniform in its range."""
        return SpotLight.shaped(self.profile, float(rng.uniform(*self.cone_angle)), float(rng.uniform(*self.falloff)))


@dataclass(frozen=True)
class PoolJob:
    """A pool of single lights, each of 1 W/sr (on its axis) in every channel.

    Attributes:
        dataset: the scene and the quality; of its seed every draw depends.
        kind: of lights.
        number: lights; of a drive, moments of `HEADLIGHTS` lights each.
        classes: where points and spots are, in turn; those that the scene has none of are left out.
        spot: the profile of spots and headlights; a drive takes the least of its ranges.
        views: cameras that see every light.
        lamps: what other kinds are like, and how near to surfaces lights are.
        cameras: where they are; by default the scene's own (`pool_cameras`).
    """

    dataset: DatasetJob
    kind: PoolKind
    number: int
    classes: tuple[LightClass, ...] = LIGHT_CLASSES
    spot: SpotRange = SpotRange()
    views: int = 3
    cameras: tuple[FixedView, ...] = ()
    lamps: LampRange = field(default_factory=LampRange)

    def __post_init__(self) -> None:
        if self.number < 1:
            raise ValueError(f"number must be at least 1, got {self.number}")
        if self.cameras and len(self.cameras) < self.views:
            raise ValueError(f"{self.views} views take as many cameras, got {len(self.cameras)}")

    def to_json(self) -> dict:
        """Everything of the job, as JSON has it."""
        return asdict(self) | {"dataset": self.dataset.to_json()}

    @classmethod
    def from_json(cls, content: dict) -> PoolJob:
        """The job that `to_json` described."""
        spot = content["spot"]
        ranges = SpotRange(spot["profile"], tuple(spot["cone_angle"]), tuple(spot["falloff"]))
        dataset = DatasetJob.from_json(content["dataset"])
        classes = tuple(content["classes"])
        cameras = tuple(
            FixedView(tuple(view["origin"]), tuple(view["focus"]), view["degrees"]) for view in content["cameras"]
        )
        lamps = {name: value if value is None else tuple(value) for name, value in content["lamps"].items()}
        lamps = LampRange(**lamps)
        return cls(dataset, content["kind"], content["number"], classes, ranges, content["views"], cameras, lamps)
