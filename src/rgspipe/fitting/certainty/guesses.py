"""How an answer moves with the albedo of surfaces that no camera saw.

If the albedo of a guessed surface is e^δ times what it was taken for, the light that leaves it is, too, and with what
bounces on of that the image changes by δ·d. Least squares take that for a move of the lights by H⁻¹ Jᵀd δ.
"""

from __future__ import annotations

from torch import Tensor

from rgspipe.fitting.model.moments import image_scores
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.refine import State


def guess_scores(problem: LightProblem, state: State, weights: Tensor) -> Tensor:
    """(S, n) float64 Jᵀd τ of the unknowns, for S guessed surfaces whose log albedo is in doubt by τ.

    Args:
        weights: (P, 3) or (P, 1) squared weights of the pixels.
    """
    return image_scores(state.columns, _changes(problem, state), weights, state.intensity)


def _changes(problem: LightProblem, state: State) -> Tensor:
    """(S, P, 3) τ d, of images as the problem's target is; none where light does not bounce."""
    views, effects = problem.views, problem.model.effects
    surfaces = views.guesses
    if not len(surfaces) or not effects.interreflection:
        return problem.target.new_zeros((0, *problem.target.shape))
    sent = views.frozen.radiance_of(state.lights(problem), effects).detach()
    for known, strength in zip(problem.known, state.intensity[len(state.emitters) :], strict=True):
        if known.sent is not None:
            sent = sent + known.sent * (known.unit * strength).to(sent)
    doubt = views.frozen.surfels.guessed * surfaces
    own = doubt.T[:, None, :].to(sent) * sent[:, :, None]
    changed = views.operator @ (own + views.frozen.indirect(own)).reshape(len(sent), -1)
    images = changed.reshape(-1, 3, len(surfaces)).permute(2, 0, 1)
    exposures = 1.0 if problem.exposures is None else problem.exposures.to(images)[problem.model.view_of][:, None]
    return images / (problem.scale * exposures)
