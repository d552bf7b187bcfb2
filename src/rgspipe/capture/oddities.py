"""What of a capture is not a closed room of matt surfaces: what glows, shines or mirrors, and where light leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.radiance import Measured
from rgspipe.capture.shared_errors import excess
from rgspipe.training.albedo import ALBEDO_RANGE

#: Surfaces that send this many times the light that falls on them glow, whatever errors the gather has.
GLOWS = 2.0

#: Relative error of a surfel's pixels, over the median of all, from which on photographs do not agree about it.
DISAGREE = 5.0

#: How far around the strongest of them others are of one kind, in parts of the scene's size.
AROUND = 0.1


@dataclass(frozen=True)
class Odd:
    """Surfels that are not matt and lit, or that look out of the room.

    Attributes:
        share: how much of the whole they are: of the light that glowing ones send beside all lamps', of what surfaces
            send that leaves the scene, of the area else.
        place: where the strongest are, scene units.
    """

    share: float
    place: tuple[float, float, float]


@dataclass(frozen=True)
class Oddities:
    """What was odd, None for what was not there.

    Attributes:
        glowing: lamps, windows.
        shining: gloss, mirrors, whatever looks different from different sides.
        open: what looks on nothing, as the front of a room does, or a wall is missing.
        impossible: part of the measured surfels whose albedo would have to be beyond 1.
        single: part of them that one photograph alone shows.
    """

    glowing: Odd | None
    shining: Odd | None
    open: Odd | None
    impossible: float
    single: float

    @classmethod
    def of(cls, problem: LampProblem, lamps: Lamps, measured: Measured) -> Oddities:
        """What the lamps leave."""
        used = np.isfinite(problem.pixels)
        beyond = (excess(problem, lamps) > 0.0).any(axis=1)
        return cls(
            _glowing(problem, lamps, used),
            _shining(problem, measured, used),
            _open(problem, lamps),
            float(beyond[used].mean()) if used.any() else 0.0,
            float((measured.shown_by[used] <= 1).mean()) if used.any() else 0.0,
        )


def _glowing(problem: LampProblem, lamps: Lamps, used: np.ndarray) -> Odd | None:
    arriving = problem.arriving(lamps).mean(axis=1)
    sent, areas = problem.radiance.mean(axis=1), problem.frozen.areas.double().cpu().numpy()
    glow = np.where(used & (sent > GLOWS * arriving), (sent - arriving) * areas, 0.0)
    if not glow.any():
        return None
    # A lamp's own numbers are radiance too: what it sends on all surfaces over π.
    return Odd(float(glow.sum() / (glow.sum() + lamps.sent(areas).sum() / 3.0)), _place(problem, glow))


def _shining(problem: LampProblem, measured: Measured, used: np.ndarray) -> Odd | None:
    several = used & (measured.shown_by >= 2)
    if not several.any():
        return None
    areas, apart = problem.frozen.areas.double().cpu().numpy(), measured.apart
    odd = np.where(several & (apart > DISAGREE * max(float(np.median(apart[several])), 0.01)), areas, 0.0)
    return Odd(float(odd.sum() / areas[several].sum()), _place(problem, odd * apart)) if odd.any() else None


def _open(problem: LampProblem, lamps: Lamps) -> Odd | None:
    areas = problem.frozen.areas.double().cpu().numpy()
    sent = areas * (np.clip(problem.albedo(lamps), *ALBEDO_RANGE) * problem.arriving(lamps)).mean(axis=1)
    leaves = np.maximum(1.0 - np.asarray(problem.receivers.gather.sum(axis=1)).ravel(), 0.0)
    share = float(sent @ leaves / sent.sum())
    return Odd(share, _place(problem, areas * leaves)) if share > 0.0 else None


def _place(problem: LampProblem, weight: Numbers) -> tuple[float, float, float]:
    """The mean of what is around the surfel with the greatest `weight` (N,)."""
    centers = problem.frozen.surfels.centers.double().cpu().numpy()
    near = np.linalg.norm(centers - centers[weight.argmax()], axis=1) <= AROUND * problem.size
    x, y, z = (weight[near] @ centers[near] / weight[near].sum()).tolist()
    return x, y, z
