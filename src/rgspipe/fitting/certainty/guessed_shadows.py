"""How an answer moves with the places of surfaces that no camera saw, by the shadows that these cast.

They are laid down one distance of surfels apart, so that where they end is known to that: to a standard deviation of
1/√12 of it, as all places within it are alike. A shadow's edge is displaced as a whole, on all pixels that look at it
and in all views, and least squares take that for a move of the lights.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.moments import image_scores
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.refine import State
from rgspipe.renderer.displaced import displaced
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import ViewModel
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.places import ways_to
from rgspipe.renderer.pixel_direct import surfel_transmittance

#: Derivatives are differences over this part of the doubt: over all of it an edge crosses several pixels.
STEP = 0.125

#: A surfel of which another part than this is lit is on the edge of a shadow.
CHANGED = 1e-3


def shadow_scores(problem: LightProblem, state: State, weights: Tensor) -> Tensor:
    """(S, n) float64 Jᵀd δ of the unknowns, for S guessed surfaces whose places along their normals are in doubt by δ.

    Those are left out whose shadows end where no view looks.

    Args:
        weights: (P, 3) or (P, 1) squared weights of the pixels.
    """
    frozen, model = problem.views.frozen, problem.model
    if not isinstance(model, ViewModel) or not model.effects.shadows or not len(problem.views.guesses):
        changes = problem.target.new_zeros((0, *problem.target.shape))
        return image_scores(state.columns, changes, weights, state.intensity)
    doubts = problem.views.guesses[:, :, None] * _doubt(frozen, problem.views.guesses)[:, None, None]
    doubts = doubts * frozen.surfels.normals
    casting = _casting(problem, state.emitters, doubts.sum(dim=0))
    changes = [_change(model, state, displaced(frozen, STEP * along)) / STEP for along in doubts[casting]]
    stacked = torch.stack(changes) if changes else problem.target.new_zeros((0, *problem.target.shape))
    return image_scores(state.columns, stacked, weights, state.intensity)


def _doubt(frozen: FrozenScene, surfaces: Tensor) -> Tensor:
    """(S,) standard deviation of the places of surfaces (S, N), scene units."""
    return torch.stack([(frozen.areas[own > 0.0].median() / 12.0).sqrt() for own in surfaces])


def _change(model: ViewModel, state: State, moved: FrozenScene) -> Tensor:
    """(P, 3) what the image gains in another scene."""
    there, change = model.among(moved), torch.zeros(())
    for emitter, columns, strength in zip(state.emitters, state.columns, state.intensity, strict=False):
        change = change + (there.columns(emitter)[:, :, 0] - columns[:, :, 0]) * strength.to(columns)
    return change


def _casting(problem: LightProblem, emitters: Sequence[Emitter], along: Tensor) -> Tensor:
    """(S,) bool: the guessed surfaces that are in the light of surfels in sight where, moved by `along` (N, 3) all
    together, they change a shadow."""
    views, frozen = problem.views, problem.views.frozen
    centers = frozen.surfels.centers.double() if frozen.centers is None else frozen.centers
    moved = displaced(frozen, along)
    looked_at = torch.bincount(views.operator.matrix.col_indices(), minlength=len(centers)) > 0
    casting = torch.zeros(len(views.guesses), dtype=torch.bool, device=frozen.device)
    for emitter in emitters:
        place = emitter.light.place
        passing = [surfel_transmittance(scene.bvh, place)[0] for scene in (frozen, moved)]
        chosen = (looked_at & ((passing[0] - passing[1]).abs() > CHANGED)).nonzero()[:, 0]
        ways = ways_to(place, centers[chosen])
        lengths = ways.norm(dim=1, keepdim=True)
        for scene in (frozen, moved):
            hits = composite(scene.bvh, centers[chosen], (ways / lengths).float(), two_sided=True)
            between = (hits.indices >= 0) & (hits.depths < (math.inf if emitter.light.distant else lengths))
            met = hits.indices[between].long().unique()
            casting |= views.guesses[:, met].any(dim=1)
    return casting
