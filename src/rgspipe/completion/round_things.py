"""Round things of which one side was seen: they go all the way around."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from rgspipe.completion.balls import SeenBall, balls_among
from rgspipe.completion.free_space import SeenSpace
from rgspipe.completion.rasters import BARE, BEYOND, Continued, are_near
from rgspipe.completion.revolved import Revolved, things_of_revolution

#: Finds things among surfels at (N, 3) with normals (N, 3), a distance apart.
Finder = Callable[[np.ndarray, np.ndarray, float], "Sequence[SeenBall | Revolved]"]


@dataclass(frozen=True)
class RoundThings:
    """All round things among surfels.

    Attributes:
        whole: places all around them.
        added: those of them that nobody saw.
        members: (M,) int64 indices of their surfels.
    """

    whole: Continued
    added: Continued
    members: np.ndarray


def round_things(centers: np.ndarray, normals: np.ndarray, space: SeenSpace, spacing: float) -> RoundThings:
    """Those that cameras did not look through more than they saw of them.

    Args:
        centers, normals: (N, 3) of surfels, along the axes of their room.
        space: what cameras looked through.
    """
    whole, added, rest = [], [], np.arange(len(centers))
    # A ball has all axes: it comes first, and then what stands.
    kinds: list[tuple[Finder, int]] = [(balls_among, 0), *((things_of_revolution, turn) for turn in (0, 1, 2))]
    for found_among, turn in kinds:
        order = np.roll(np.arange(3), turn)
        back = np.argsort(order)
        of_kind = rest
        for thing in found_among(centers[of_kind][:, order], normals[of_kind][:, order], spacing):
            around = thing.all_around(spacing)
            around = Continued(around.places[:, back], around.normals[:, back])
            seen = are_near(centers, around.places, BARE * spacing)
            behind = torch.from_numpy(around.places - BEYOND * spacing * around.normals)
            crossed = space.holds(behind, 0.0, around=True).numpy() & ~seen
            if seen.sum() > crossed.sum():
                whole.append(around)
                added.append(around.chosen(~seen & ~crossed))
                rest = np.setdiff1d(rest, of_kind[thing.members])
    members = np.setdiff1d(np.arange(len(centers)), rest)
    return RoundThings(Continued.joined(whole), Continued.joined(added), members)
