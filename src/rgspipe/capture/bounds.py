"""Channels of surfaces that are known from below alone, as they are clipped in every photograph.

Under some lamps such a surfel sends ρ d, with the albedo that the field continues into it. Where that is above the
bound b, what was measured is met whatever it is above by: it says nothing, and the surfel sends what it gets, as one
that no camera saw. Where it is below, the least that the surfel may send is the likeliest: L = b, measured like any
other, and that is what others get from it. Which bounds count so depends on the lamps, and is asked anew for each round
of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.training.albedo import ALBEDO_RANGE


def with_bounds(problem: LampProblem, lamps: Lamps | None) -> tuple[LampProblem, Lamps | None]:
    """The problem in which those bounds count that lamps do not meet, and what lamps make of it.

    None count before there are lamps.
    """
    if lamps is None or problem.clipped is None:
        return problem, lamps
    albedo = np.clip(problem.albedo(lamps), *ALBEDO_RANGE)
    met = problem.clipped & (albedo * problem.arriving(lamps) > problem.radiance)
    told = np.isfinite(problem.pixels)[:, None] & ~met
    received = problem.received.with_told(told, albedo)
    problem = replace(problem, received=received, field=replace(problem.field, told=told))
    return problem, problem.lamps(lamps.places, lamps.logs)
