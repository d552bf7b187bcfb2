"""Errors of the model of light that a whole part of the scene shares, and what they leave unknown of the lamps.

A shift δ of what is measured, log L, moves the lamps' numbers by θ = (Jᵀ Σ⁻¹ J)⁻¹ Jᵀ Σ⁻¹ δ. Three shifts are known from
what was found itself, each in B parts of the scene that are taken for independent:

- Surfaces cannot reflect more than all light. Where the lamps call for more, the model lacks light, by at least what is
  beyond; errors of this size are everywhere, as where light is missing albedo hides it as long as it can.
- What lamps and paint leave unexplained, σ, may be the light of a lamp that was not found, wherever that is: a shift of
  the size σ, as the light of each candidate is spread, all of them alike likely.
- What no camera saw sends light by an albedo that is a guess, of the deviation that surfaces of this scene have.

    C = Σ_b θ_b θ_bᵀ
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rgspipe.capture.candidates import CandidateLamps
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.variances import FREEDOM
from rgspipe.training.albedo import ALBEDO_RANGE


def shared_covariance(problem: LampProblem, lamps: Lamps) -> Numbers:
    """(6 K, 6 K) of the lamps' numbers."""
    jacobian, spread = problem.jacobian(lamps), problem.covariance(lamps)
    whitened = [problem.field.channel(c).whitened(columns) for c, columns in enumerate(jacobian)]
    shifts = [*_beyond(problem, lamps), *_unseen(problem, lamps)]
    moved = [spread @ sum(part.T @ shift[:, k] for k, part in enumerate(whitened)) for shift in shifts]
    missing = spread @ sum(part.T for part in whitened) @ _missing(problem, lamps)
    return np.stack(moved).T @ np.stack(moved) + missing @ missing.T


def excess(problem: LampProblem, lamps: Lamps) -> Numbers:
    """(N, 3) by how much the logarithm of the albedo is beyond what surfaces may reflect; 0 where nothing was seen."""
    albedo = problem.albedo(lamps)
    beyond = np.maximum(np.log(albedo / ALBEDO_RANGE[1]), 0.0)
    used = np.stack([problem.field.channel(c).weight > 0.0 for c in range(3)], axis=1)
    return np.where(used, beyond, 0.0)


def _beyond(problem: LampProblem, lamps: Lamps) -> Iterator[Numbers]:
    """(N, 3) shifts by impossible albedo, one a part."""
    used = problem.field.weight > 0.0
    size = float(np.sqrt((excess(problem, lamps)[used] ** 2).mean())) if used.any() else 0.0
    for part in np.unique(problem.parts):
        yield size * np.repeat((problem.parts == part)[:, None], 3, axis=1)


def _missing(problem: LampProblem, lamps: Lamps) -> Numbers:
    """(N, C) shifts by one more lamp at each of C candidates, over √C."""
    used = problem.field.weight > 0.0
    spread = CandidateLamps.of(problem).shares / problem.arriving(lamps).mean(axis=1)[:, None]
    size = np.sqrt((spread[used] ** 2).mean(axis=0))
    shining = size > 0.0
    # The variance of Student's t, of which the noise is the scale.
    unexplained = problem.field.variances.noise * FREEDOM / (FREEDOM - 2.0)
    shifts = np.sqrt(unexplained) * spread[:, shining] / size[shining]
    return shifts / np.sqrt(max(int(shining.sum()), 1))


def _unseen(problem: LampProblem, lamps: Lamps) -> Iterator[Numbers]:
    """(N, 3) shifts by light from surfaces that no camera saw, one a part that has any."""
    received, arriving = problem.received, problem.arriving(lamps)
    deviation = np.sqrt(problem.field.variances.surface)
    sent = received.albedo * arriving[received.unseen]
    parts = problem.parts[received.unseen]
    for part in np.unique(parts):
        own = np.where((parts == part)[:, None], sent, 0.0)
        yield deviation * received.from_unseen.arriving(own) / arriving
