"""Which lights of a pool make up the rig of a fit target, and how bright they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import torch

from rgspipe.blender.pool.job import HEADLIGHTS
from rgspipe.blender.targets import random_intensity
from rgspipe.errors import InputError
from rgspipe.scene import Light, LightRig
from rgspipe.scene.lights import WATTS_PER_INTENSITY

#: Number of the random stream of rigs; part of the seed.
STREAM = 20

#: Draws of a rig before it counts as impossible, and those after which another light comes first.
MAX_DRAWS, DRAWS_PER_LIGHT = 10_000, 100

#: RGB of headlights over their mean.
HEADLIGHT_COLOUR = (1.1, 1.0, 0.9)


@dataclass(frozen=True)
class RigRequest:
    """What rigs are wanted.

    Attributes:
        number: how many.
        count: fewest and most lights of a rig.
        mixed: whether a rig of several lights must have both points and spots.
        weakest: least share of a light in the mean radiance of the rig's images.
        separation: least distance of two lights, scene units.
        seed: of all draws; each rig draws from its own stream, so that rig k does not depend on how many there are.
    """

    number: int
    count: tuple[int, int] = (1, 1)
    mixed: bool = False
    weakest: float = 0.15
    separation: float = 0.1
    seed: int = 0


@dataclass(frozen=True)
class RigPlan:
    """A rig.

    Attributes:
        members: its lights, as indices into the pool.
        lights: the same lights with their intensities.
        shares: of each light in the mean radiance.
    """

    members: tuple[int, ...]
    lights: LightRig
    shares: tuple[float, ...]


def draw_rigs(pool: Sequence[Light], brightness: np.ndarray, request: RigRequest) -> list[RigPlan]:
    """Rigs of random lights of `pool`, each light of the power of a point light of about 1 W/sr, in random colours.

    Every light of the pool comes first in a rig before one comes first again; the others are drawn uniformly.

    Args:
        pool: lights of 1 W/sr.
        brightness: (K, 3) mean radiance of each one's images.

    Raises:
        InputError: no such rig was found.
    """
    check_request(len(pool), request)
    known = _Pool.of(pool, brightness)
    return [_draw(known, request, number) for number in range(request.number)]


def headlight_rigs(pool: Sequence[Light], brightness: np.ndarray) -> list[RigPlan]:
    """The rigs of a drive: its lights, pair by pair, all of the same intensity."""
    known, colour = _Pool.of(pool, brightness), np.array(HEADLIGHT_COLOUR)
    pairs = [tuple(range(first, first + HEADLIGHTS)) for first in range(0, len(pool), HEADLIGHTS)]
    return [known.rig(pair, [colour * known.units[index] for index in pair]) for pair in pairs]


def unit_power(light: Light) -> float:
    """Axial intensity [W/sr] with which `light`, of 1 W/sr, has the power of a point light of 1 W/sr; 1 of a sun."""
    if light.distant:
        return 1.0
    return WATTS_PER_INTENSITY / float(light.power().mean())


@dataclass(frozen=True)
class _Pool:
    """What is asked about the lights of a pool again and again.

    Attributes:
        lights: of 1 W/sr.
        brightness: (K, 3) mean radiance of each one's images.
        units: (K,) `unit_power` of each.
        places: (K, 3) positions; of suns unit vectors towards them, so that distances are angles [rad].
    """

    lights: Sequence[Light]
    brightness: np.ndarray
    units: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, lights: Sequence[Light], brightness: np.ndarray) -> _Pool:
        places = np.array([light.standing(1.0).tolist() for light in lights])
        return cls(lights, brightness, np.array([unit_power(light) for light in lights]), places)

    def fits(self, members: tuple[int, ...], request: RigRequest) -> bool:
        """Whether the lights are different ones, far enough from each other, and of the types that are wanted."""
        if len(set(members)) < len(members):
            return False
        pairs = combinations(members, 2)
        if any(np.linalg.norm(self.places[a] - self.places[b]) < request.separation for a, b in pairs):
            return False
        return not request.mixed or len(members) == 1 or len({type(self.lights[index]) for index in members}) == 2

    def rig(self, members: tuple[int, ...], intensities: Sequence[np.ndarray]) -> RigPlan:
        """These lights with these intensities [W/sr], each (3,)."""
        pairs = list(zip(members, intensities, strict=True))
        radiance = np.array([self.brightness[index] @ intensity for index, intensity in pairs])
        lights = [replace(self.lights[index], intensity=torch.from_numpy(intensity)) for index, intensity in pairs]
        return RigPlan(members, tuple(lights), tuple((radiance / radiance.sum()).tolist()))


def _draw(pool: _Pool, request: RigRequest, number: int) -> RigPlan:
    rng, size = np.random.default_rng([request.seed, STREAM, number]), len(pool.lights)
    count = int(rng.integers(request.count[0], request.count[1] + 1))
    for attempt in range(MAX_DRAWS):
        first = (number + attempt // DRAWS_PER_LIGHT) % size
        members = (first, *rng.choice(size, count - 1, replace=False).tolist())
        if not pool.fits(members, request):
            continue
        rig = pool.rig(members, [random_intensity(rng, pool.units[index]) for index in members])
        if count == 1 or min(rig.shares) >= request.weakest:
            return rig
    raise InputError(
        "targets",
        expected=f"rigs of {count} lights, at least {request.separation:g} from each other, each with at least "
        f"{request.weakest:g} of the mean radiance",
        found=f"none in {MAX_DRAWS} draws from {size} lights",
        remedy="Lower RigRequest.weakest or RigRequest.separation, or have more lights in the pool.",
    )


def check_request(size: int, request: RigRequest) -> None:
    """Refuse what no pool of `size` lights can give, whatever they are.

    Raises:
        InputError: names the key and what would do.
    """
    fewest, most = request.count
    if fewest > most:
        found = f"{fewest} to {most}"
        raise InputError("RigRequest.count", expected="fewest, then most", found=found, remedy="Put them in order.")
    if most > size:
        expected = f"at most the {size} lights of the pool"
        raise InputError("RigRequest.count", expected=expected, found=str(most), remedy="Ask for fewer.")
    if most > 1 and most * request.weakest >= 1.0:
        raise InputError(
            "RigRequest.weakest",
            expected=f"below {1.0 / most:.3g}: {most} lights share the whole",
            found=f"{request.weakest:g}",
            remedy="Lower it, or ask for fewer lights.",
        )
