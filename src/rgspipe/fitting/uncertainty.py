"""How sure a fit is of each of its lights."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.fitting.moments import covariance
from rgspipe.fitting.problem import LightProblem
from rgspipe.fitting.refine import State


def light_covariances(problem: LightProblem, state: State) -> tuple[Tensor, ...]:
    """Per light the covariance of its natural parameters and intensities; see `FitResult.covariance`.

    All lights' parameters are uncertain together: each matrix is a block of the joint covariance.
    """
    ones = torch.ones_like(problem.target[:, :1])
    system = problem.moments(state.columns, ones)
    joint = covariance(system, state.intensity, problem.target.numel())
    parameters = len(system.owners)
    blocks = []
    for index, emitter in enumerate(state.emitters):
        own = (system.owners == index).nonzero()[:, 0]
        colours = parameters + 3 * index + torch.arange(3)
        chosen = torch.cat([own, colours])
        spread = torch.block_diag(emitter.spread(), problem.scale * torch.eye(3, dtype=torch.float64))
        blocks.append(spread @ joint[chosen][:, chosen] @ spread.T)
    return tuple(blocks)
