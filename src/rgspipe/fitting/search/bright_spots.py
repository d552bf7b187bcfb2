"""Where lights shine on a spot that the scene's patches see badly: the same problem with such spots seen well."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.refine import State
from rgspipe.renderer.bright_spots import spot_share, with_bright_spots
from rgspipe.renderer.images.model import ViewModel
from rgspipe.renderer.kernels.lit_transmittance import LEAST_LIT
from rgspipe.renderer.lit_surfels import lit_columns

#: Share of what surfaces reflect first above which a spot is seen well: a lamp in a room of size 1 reaches it 0.25 from
#: a wall. Twice as much leaves out those from 0.13 to 0.25 away, which are up to 0.002 off without; half of it has not
#: been tried.
NOTABLE = 0.1


def seeing_bright_spots(problem: LightProblem, states: Sequence[State]) -> LightProblem:
    """The problem with the bright spots of some rigs seen well; itself where none is notable, or light does not bounce.

    Scenes with gloss keep their patches: over gloss light goes from patch to patch.
    """
    model, frozen = problem.model, problem.views.frozen
    if not isinstance(model, ViewModel) or not model.effects.interreflection or frozen.gloss or frozen.solver:
        return problem
    lightings = [_irradiance(problem, state) for state in states]
    seen = with_bright_spots(frozen, [one for one in lightings if spot_share(frozen, one) > NOTABLE])
    return problem.in_scene(seen)


def _irradiance(problem: LightProblem, state: State) -> Tensor:
    """(N,) of all lights of a rig."""
    frozen, effects = problem.views.frozen, problem.model.effects
    total = torch.zeros(len(frozen.surfels), device=frozen.device)
    for emitter, strength in zip(state.emitters, state.intensity, strict=False):
        total = total + lit_columns(frozen.bvh, emitter, effects, LEAST_LIT)[:, 0] * float(strength.mean())
    return total
