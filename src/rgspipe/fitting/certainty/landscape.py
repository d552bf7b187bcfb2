"""Slices through the loss around an answer: what a fit sees when it moves one light."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.moves import Region
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.progress import progress_bar

#: The planes: pairs of axes.
PLANES = ((0, 1), (0, 2), (1, 2))

#: Solutions for the intensities at one place, each with the clipped values that count at the one before.
CLIPPED_ROUNDS = 8


@dataclass(frozen=True)
class LossSlice:
    """The loss on a plane through the answer, the intensities of all lights the best ones at each place.

    Attributes:
        axes: which of x, y, z run across and up.
        across, up: (n,) float64 coordinates, scene units; the middle of each is the answer.
        loss: (n, n) float64, rows along `up`: Σ (target − image)² / Σ target²; NaN outside the region that is
            searched. Clipped values of the target count only where the image is darker than they are.
    """

    axes: tuple[int, int]
    across: Tensor
    up: Tensor
    loss: Tensor


def loss_slices(
    problem: LightProblem, rig: Sequence[Emitter], light: int = 0, *, reach: float = 0.25, points: int = 17
) -> tuple[LossSlice, ...]:
    """The loss on three planes through one light of a rig, while the others stay where they are.

    Args:
        light: the light that moves.
        reach: half the side of the planes, a fraction of the scene's size.
        points: places along each side; odd, so that the answer is one of them.

    Raises:
        ValueError: an even number of points, or fewer than three.
    """
    if points < 3 or points % 2 == 0:
        raise ValueError(f"points must be odd and at least 3, got {points}")
    region = Region.of(problem.views.frozen)
    fixed = [problem.evaluate(emitter) for index, emitter in enumerate(rig) if index != light]
    offsets = torch.linspace(-reach, reach, points, dtype=torch.float64) * region.size
    answer = rig[light].position

    def loss_at(position: Tensor) -> float:
        if not torch.equal(region.clip(position), position):
            return float("nan")
        moved = rig[light].placed(position)
        columns = [*fixed, problem.evaluate(moved), *problem.known_columns]
        return problem.unexplained(columns, best_intensity(problem, columns))

    losses = torch.empty((len(PLANES), points, points), dtype=torch.float64)
    rows = list(itertools.product(range(len(PLANES)), range(points)))
    for plane, row in progress_bar(rows, "loss around the answer", unit="row"):
        for column, along in enumerate(offsets):
            position = answer.clone()
            position[list(PLANES[plane])] += torch.stack([along, offsets[row]])
            losses[plane, row, column] = loss_at(position)
    pairs = zip(PLANES, losses, strict=True)
    return tuple(LossSlice(axes, answer[axes[0]] + offsets, answer[axes[1]] + offsets, loss) for axes, loss in pairs)


def best_intensity(problem: LightProblem, columns: Sequence[Tensor]) -> Tensor:
    """(L, 3) intensities ≥ 0 of least squares for the lights' evaluations `columns`.

    Clipped values are left out of the first solution; of the others those count where the image of the one before is
    darker than the clip, as in the steps of a fit. Squares of one-sided residuals are convex, and these are Newton's
    steps on them.
    """
    intensity = problem.moments(columns, problem.unclipped(PLAIN.base(problem).square())).intensity
    if problem.clip is None:
        return intensity
    for _ in range(CLIPPED_ROUNDS):
        before = intensity
        intensity = problem.moments(columns, PLAIN.at(problem, columns, before)).intensity
        if torch.allclose(intensity, before, rtol=1e-9, atol=0.0):
            break
    return intensity
