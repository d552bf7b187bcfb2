"""Places where lamps may be, ranked on surfels alone beside the lamps that are known.

A candidate is ranked with the intensity that suits it, in one grey channel, by a few steps of Gauss and Newton that all
candidates take at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.capture.lamps import DARK, LampProblem, Lamps
from rgspipe.capture.photographs import Numbers

#: Steps of candidates' intensities.
RANKING = 5

#: Largest step of the logarithm of a candidate's intensity.
LONGEST_GAIN = 1.5

#: Candidates that are ranked at once.
BATCH = 128


@dataclass(frozen=True, eq=False)
class CandidateLamps:
    """Grey lamps in places where lamps may be, and what each sends to every surfel, T e.

    Attributes:
        places: (C, 3) scene units.
        shares: (N, C).
    """

    places: Numbers
    shares: Numbers

    @classmethod
    def of(cls, problem: LampProblem) -> CandidateLamps:
        """Those of the scene's dictionary."""
        places, irradiance = problem.receivers.candidates()
        return cls(places, problem.received.spread(irradiance.T))

    @cached_property
    def between(self) -> float:
        """Half of the typical distance of neighbours, scene units: how far a lamp is from the next candidate."""
        return 0.5 * float(np.median(cKDTree(self.places).query(self.places, k=2)[0][:, 1]))

    def around(self, problem: LampProblem, place: Numbers) -> CandidateLamps:
        """Those of a cube around `place` (3,) whose sides are two of `between`, where lamps may be."""
        sides = np.array([offset for offset in product((-1.0, 0.0, 1.0), repeat=3) if any(offset)])
        places = np.clip(place + self.between * sides, *problem.bounds)
        irradiance, _ = problem.receivers.irradiance(places)
        return CandidateLamps(places, problem.received.spread(irradiance.T))


def ranked(problem: LampProblem, candidates: CandidateLamps, known: Lamps | None) -> tuple[Numbers, Numbers]:
    """(C,) cost of one more grey lamp at each candidate, and (C,) the logarithm of its intensity over π."""
    grey = _grey(problem)
    target = (grey * problem.target).sum(axis=1)
    light = problem.received.known + (0.0 if known is None else known.arriving)
    light = np.maximum(np.exp((grey * np.log(np.maximum(light, 1e-300))).sum(axis=1)), DARK * np.median(light))
    sent = np.exp(target) * 0.2
    costs, logs = [], []
    for begin in range(0, candidates.shares.shape[1], BATCH):
        shares = candidates.shares[:, begin : begin + BATCH]
        typical = np.array([np.median(column[column > 0.0]) if (column > 0.0).any() else 1.0 for column in shares.T])
        gain = np.log(np.median(sent) / np.maximum(typical, 1e-300))
        for _ in range(RANKING):
            own = shares * np.exp(gain)
            arriving = own + light[:, None]
            residual, slope = target[:, None] - np.log(arriving), own / arriving
            whitened = problem.field.whitened(slope)
            step = (whitened * residual).sum(axis=0) / np.maximum((whitened * slope).sum(axis=0), 1e-12)
            gain = gain + np.clip(step, -LONGEST_GAIN, LONGEST_GAIN)
        residual = target[:, None] - np.log(shares * np.exp(gain) + light[:, None])
        costs.append((residual * problem.field.whitened(residual)).sum(axis=0))
        logs.append(gain)
    return np.concatenate(costs), np.concatenate(logs)


def _grey(problem: LampProblem) -> Numbers:
    """(N, 3) what each channel counts in the mean of those that were measured."""
    told = problem.field.told
    if told is None:
        return np.full((len(problem.radiance), 3), 1.0 / 3.0)
    known = np.where(told.any(axis=1, keepdims=True), told, True)
    return known / known.sum(axis=1, keepdims=True)
