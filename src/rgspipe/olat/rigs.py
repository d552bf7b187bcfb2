"""Which lights of a pool make up the rig of a fit target, and how bright they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from rgspipe.blender.targets import random_intensity
from rgspipe.errors import InputError
from rgspipe.olat.job import HEADLIGHTS
from rgspipe.renderer.spot import spot_power
from rgspipe.scene import Light, LightRig, PointLight, SpotLight

#: Number of the random stream of rigs; part of the seed.
STREAM = 20

#: Draws of a rig before it counts as impossible, and those after which another light comes first.
MAX_DRAWS, DRAWS_PER_LIGHT = 20_000, 200

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
    _check(len(pool), request)
    return [_draw(pool, brightness, request, number) for number in range(request.number)]


def headlight_rigs(pool: Sequence[Light], brightness: np.ndarray) -> list[RigPlan]:
    """The rigs of a track: its lights, pair by pair, all of the same intensity."""
    pairs = [range(first, first + HEADLIGHTS) for first in range(0, len(pool), HEADLIGHTS)]
    colour = np.array(HEADLIGHT_COLOUR)
    return [_rig(pool, brightness, tuple(pair), [colour * unit_power(pool[k]) for k in pair]) for pair in pairs]


def unit_power(light: Light) -> float:
    """Axial intensity [W/sr] with which `light`, of 1 W/sr, has the power of a point light of 1 W/sr."""
    return 4.0 * math.pi / float(spot_power(light).mean()) if isinstance(light, SpotLight) else 1.0


def _draw(pool: Sequence[Light], brightness: np.ndarray, request: RigRequest, number: int) -> RigPlan:
    rng = np.random.default_rng([request.seed, STREAM, number])
    count = int(rng.integers(request.count[0], request.count[1] + 1))
    for attempt in range(MAX_DRAWS):
        first = (number + attempt // DRAWS_PER_LIGHT) % len(pool)
        members = (first, *rng.choice(len(pool), count - 1, replace=False).tolist())
        intensities = [random_intensity(rng, unit_power(pool[index])) for index in members]
        if not _fits(pool, members, request):
            continue
        rig = _rig(pool, brightness, members, intensities)
        if count == 1 or min(rig.shares) >= request.weakest:
            return rig
    raise InputError(
        "targets",
        expected=f"rigs of {count} lights, at least {request.separation:g} from each other, each with at least "
        f"{request.weakest:g} of the mean radiance",
        found=f"none in {MAX_DRAWS} draws from {len(pool)} lights",
        remedy="Lower targets.weakest or targets.separation, or raise targets.pool.",
    )


def _fits(pool: Sequence[Light], members: tuple[int, ...], request: RigRequest) -> bool:
    """Whether the lights are different ones, far enough from each other, and of the types that are wanted."""
    if len(set(members)) < len(members):
        return False
    places = torch.stack([pool[index].position for index in members])
    if len(members) > 1 and float(torch.pdist(places).min()) < request.separation:
        return False
    return not request.mixed or len(members) == 1 or len({type(pool[index]) for index in members}) == 2


def _rig(
    pool: Sequence[Light], brightness: np.ndarray, members: tuple[int, ...], intensities: Sequence[np.ndarray]
) -> RigPlan:
    radiance = np.array([brightness[k] @ intensity for k, intensity in zip(members, intensities, strict=True)])
    lights = [_with_intensity(pool[k], intensity) for k, intensity in zip(members, intensities, strict=True)]
    return RigPlan(members, tuple(lights), tuple((radiance / radiance.sum()).tolist()))


def _with_intensity(light: PointLight | SpotLight, intensity: np.ndarray) -> Light:
    return replace(light, intensity=torch.from_numpy(intensity))


def _check(size: int, request: RigRequest) -> None:
    fewest, most = request.count
    if fewest > most:
        found = f"{fewest} to {most}"
        raise InputError("targets.count", expected="fewest, then most", found=found, remedy="Put them in order.")
    if most > size:
        raise InputError(
            "targets.count", expected=f"at most the {size} lights of the pool", found=str(most), remedy="Ask for fewer."
        )
    if most > 1 and most * request.weakest >= 1.0:
        raise InputError(
            "targets.weakest",
            expected=f"below {1.0 / most:.3g}: {most} lights share the whole",
            found=f"{request.weakest:g}",
            remedy="Lower it, or ask for fewer lights.",
        )
