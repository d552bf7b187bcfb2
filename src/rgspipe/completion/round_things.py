"""Round things of which one side was seen: they go all the way around."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch

from rgspipe.completion.balls import Ball, balls_among
from rgspipe.completion.free_space import SeenSpace
from rgspipe.completion.rasters import BARE, BEYOND, Continued, are_near
from rgspipe.completion.revolved import Revolved, things_of_revolution

#: Finds things among surfels at (N, 3) with normals (N, 3), a distance apart.
Finder = Callable[[np.ndarray, np.ndarray, float], "Sequence[Ball | Revolved]"]


def gone_around(
    centers: np.ndarray, normals: np.ndarray, space: SeenSpace, spacing: float
) -> tuple[Continued, np.ndarray]:
    """The parts that nobody saw of all round things, and the surfels (M,) of these.

    Things that cameras looked through more than they saw of them are none.

    Args:
        centers, normals: (N, 3) of surfels, along the axes of their room.
        space: what cameras looked through.
    """
    parts, rest = [], np.arange(len(centers))
    # A ball has all axes: it comes first, and then what stands.
    kinds: list[tuple[Finder, int]] = [(balls_among, 0), *((things_of_revolution, turn) for turn in (0, 1, 2))]
    for found_among, turn in kinds:
        order = np.roll(np.arange(3), turn)
        back = np.argsort(order)
        of_kind = rest
        for thing in found_among(centers[of_kind][:, order], normals[of_kind][:, order], spacing):
            whole = thing.all_around(spacing)
            whole = Continued(whole.places[:, back], whole.normals[:, back])
            seen = are_near(centers, whole.places, BARE * spacing)
            behind = torch.from_numpy(whole.places - BEYOND * spacing * whole.normals)
            crossed = space.holds(behind, 0.0, around=True).numpy() & ~seen
            if seen.sum() > crossed.sum():
                parts.append(whole.chosen(~seen & ~crossed))
                rest = np.setdiff1d(rest, of_kind[thing.members])
    return Continued.joined(parts), np.setdiff1d(np.arange(len(centers)), rest)
