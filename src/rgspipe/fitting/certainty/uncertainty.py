"""How sure a fit is of its lights: the noise of the pixels, and errors of the model that neighbouring places share.

With J the derivatives of the image towards the n unknowns x (parameters of all lights and their intensities), r the
residual and H = Σ JᵀJ, the covariance is

    ε² H^{-½} (σ² I + κ² (V − σ² I)₊ + U) H^{-½} ,     V = (1 − α) S + α tr(S)/n I ,
    S = Σ_k d_k d_kᵀ ,     d_k = (I − G_k)⁻¹ H^{-½} s_k

σ² is the residual's variance: what the noise alone leaves uncertain. S is the sandwich estimate over cells k of the
surface (Huber 1967, White 1980, clustered as by Liang and Zeger 1986): s_k = Σ Jᵀr over the pixels of all views that
look at the cell, so an error of the model counts once, however many pixels and views show it. G_k = H^{-½} H_k H^{-½}
is the share of the evidence that the cell gives; with it d_k is how the answer moves when the cell is left out (the
jackknife, Bell and McCaffrey 2002). A few cells tell nearly all of that, so S is too small in some directions and too
large in others; V pulls it towards errors that are alike in all of them, as far as the cells' differences call for
(α of Ledoit and Wolf 2004). ( )₊ keeps eigenvalues above zero, so that the noise is a lower bound. κ makes up
for what the residual cannot show, as the fit has explained it away; it was chosen on fits with known truth. U is what
surfaces that no camera saw leave uncertain, as their albedo is guessed (`certainty.guesses`), and their place, by their
shadows (`certainty.guessed_shadows`). ε ≥ 1 is the scene's own excess: lamps whose places are known lay so far outside
of their regions (`evaluation.known_lamps`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.certainty.guessed_shadows import shadow_scores
from rgspipe.fitting.certainty.guesses import guess_scores
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.moments import group_moments, information, scores
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.model.views import PreparedViews
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.fitting.search.refine import State
from rgspipe.fitting.search.weighting import PLAIN

#: Directions with less information than this part of the largest are not determined: information goes with the square
#: of the image, and that of ten unknowns that do nothing is rounding up to this.
RANK = 10.0 * ROUNDING**2


@dataclass(frozen=True)
class Covariances:
    """Per light a symmetric float64 matrix; see `FitResult.covariance` for its rows.

    Attributes:
        calibrated: of noise and errors of the model.
        noise: of noise alone, which takes the residual as independent in every pixel.
        known: (3, 3) of the strength of each known image, as `calibrated`.
    """

    calibrated: tuple[Tensor, ...] = ()
    noise: tuple[Tensor, ...] = ()
    known: tuple[Tensor, ...] = ()


def light_covariances(
    problem: LightProblem, state: State, options: CertaintyOptions | None = None, *, displaced: bool = True
) -> Covariances:
    """The covariances of a fit's lights.

    All lights are uncertain together: each matrix is a block of the joint covariance. What the views do not determine
    has an infinite variance and no covariance with the rest.

    Args:
        displaced: whether places of guessed surfaces are in doubt, too; each whose shadow is seen takes an image.
    """
    owners = _owners(state.emitters)
    blocks, strengths = [], []
    for joint, unknown in _joint(problem, state, options or CertaintyOptions(), displaced):
        blocks.append(light_blocks(state.emitters, joint, unknown, problem.scale))
        rows = len(owners) + 3 * len(state.emitters) + 3 * torch.arange(len(problem.known))[:, None] + torch.arange(3)
        pairs = zip(problem.known, rows, strict=True)
        strengths.append(tuple(_open(one.unit**2 * joint[row][:, row], unknown[row]) for one, row in pairs))
    return Covariances(*blocks, known=strengths[0])


def light_blocks(emitters: Sequence[Emitter], joint: Tensor, unknown: Tensor, scale: float) -> tuple[Tensor, ...]:
    """Per light the covariance of its own numbers and intensity, see `FitResult.covariance`.

    Args:
        joint: (n, n) covariance of all unknowns: the parameters of one light after the other, then the intensities.
        unknown: (n,) bool, which of them are not determined.
        scale: what intensities are over there.
    """
    owners, blocks = _owners(emitters), []
    for index, emitter in enumerate(emitters):
        colours = len(owners) + 3 * index + torch.arange(3)
        chosen = torch.cat([(owners == index).nonzero()[:, 0], colours])
        spread = torch.block_diag(emitter.spread(), scale * torch.eye(3, dtype=torch.float64))
        undetermined = (spread.abs() @ unknown[chosen].double()) > 0.0
        blocks.append(_open(spread @ joint[chosen][:, chosen] @ spread.T, undetermined))
    return tuple(blocks)


def _owners(emitters: Sequence[Emitter]) -> Tensor:
    """(D,) light of each parameter."""
    return torch.cat([torch.full((emitter.parameters,), index) for index, emitter in enumerate(emitters)])


def design_effect(problem: LightProblem, state: State, cell: float) -> float:
    """Σ_k |Σ_{p∈k} r_p|² / Σ_p |r_p|² over cells k of the surface, of the residual r (P, 3) of a fit (Kish 1965).

    It is 1 or less where that is noise, other in each pixel, and more where pixels that look at the same place share
    what the model gets wrong.

    Args:
        cell: as for `surface_cells`.
    """
    residual = problem.residual(state.columns, state.intensity).double().cpu()
    labels, count = surface_cells(problem.views, cell)
    sums = torch.zeros((count, 3), dtype=torch.float64).index_add(0, labels, residual)
    return float(sums.square().sum() / residual.square().sum().clamp(min=1e-300))


def surface_cells(views: PreparedViews, cell: float) -> tuple[Tensor, int]:
    """(P,) int64 cell of the surface that each trusted pixel looks at, and how many there are.

    A pixel looks at the mean place of its surfels; cells are cubes of side `cell` times the scene's size, the same for
    all views.
    """
    frozen = views.frozen
    lower = frozen.bounds[0]
    centers = (frozen.bvh.surfels.centers.detach().double() - lower.to(frozen.bvh.device)).float()
    ones = torch.ones((len(centers), 1), device=centers.device)
    sums = views.operator @ torch.cat([centers, ones], dim=1)
    places = (sums[:, :3] / sums[:, 3:].clamp(min=1e-6)).cpu()
    side = cell * frozen.size
    if not side > 0.0:
        return torch.zeros(len(places), dtype=torch.int64), 1
    # The first cell is centred on the scene's corner, so that walls lie well inside of their cells.
    index = torch.round(places / side).long()
    x, y, z = (index - index.amin(dim=0)).unbind(dim=1)
    # One number a cell: sorting rows takes many times as long.
    found, labels = torch.unique((x * (1 + y.amax()) + y) * (1 + z.amax()) + z, return_inverse=True)
    return labels, len(found)


def _joint(
    problem: LightProblem, state: State, options: CertaintyOptions, displaced: bool
) -> tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]:
    """Calibrated and noise-only covariance (n, n) of all unknowns, each with what is not determined (n,)."""
    residual = problem.residual(state.columns, state.intensity)
    weights = PLAIN.at(problem, state.columns, state.intensity)
    labels, count = surface_cells(problem.views, options.cell)
    labels = labels.to(residual.device)
    values, owners = group_moments(state.columns, residual, weights, labels, count)
    cells = information(values, owners, state.intensity)
    cell_scores = scores(values, owners, state.intensity)
    noise = float(values[..., -1, -1].sum()) / max(1, residual.numel() - cells.shape[-1])
    root, unknown = whitener(cells.sum(dim=0))
    model = inflated(sandwich(root, cells, cell_scores, options.largest_share), noise, options.inflation)
    guesses = [guess_scores(problem, state, weights)]
    if displaced:
        guesses.append(shadow_scores(problem, state, weights))
    guessed = torch.cat(guesses) @ root
    grade = problem.views.frozen.grade
    excess = 1.0 if grade is None else grade.excess
    calibrated = excess**2 * root @ (model + guessed.T @ guessed) @ root.T
    return (calibrated, unknown), (noise * root @ root.T, unknown)


def whitener(matrix: Tensor) -> tuple[Tensor, Tensor]:
    """Columns R (n, m) with RᵀHR = I that span what H (n, n) determines, and which unknowns it does not (n,).

    Unknowns have different units, so H is scaled to a unit diagonal before its rank is taken.
    """
    scale = matrix.diagonal().clamp(min=0.0).sqrt()
    inverse = torch.where(scale > 0, 1.0 / scale.clamp(min=1e-300), 0.0)
    values, vectors = torch.linalg.eigh(matrix * inverse[:, None] * inverse[None, :])
    known = values > RANK * max(float(values[-1]), 1e-300)
    root = inverse[:, None] * vectors[:, known] / values[known].sqrt()
    unknown = vectors[:, ~known].square().sum(dim=1) > 1e-6
    return root, unknown


def sandwich(root: Tensor, cells: Tensor, cell_scores: Tensor, largest_share: float) -> Tensor:
    """(m, m) V: the spread of the answer when one cell after the other is left out, in whitened unknowns, shrunk.

    Args:
        root: (n, m) of `whitener`, for the sum of all cells.
        cells: (K, n, n) information of each cell.
        cell_scores: (K, n) its Σ Jᵀr.
        largest_share: of the evidence that a cell may have.
    """
    shares, vectors = torch.linalg.eigh(root.T @ cells @ root)
    amplified = 1.0 / (1.0 - shares.clamp(min=0.0, max=largest_share))
    turned = torch.einsum("kij,ki->kj", vectors, cell_scores @ root)
    return shrunk(torch.einsum("kij,kj->ki", vectors, amplified * turned))


def shrunk(moves: Tensor) -> Tensor:
    """(m, m) (1 − α) S + α tr(S)/m I of S = Σ_k d_k d_kᵀ for `moves` (K, m), the d_k; it keeps the trace.

    α is the share of what sets S apart from errors that are alike in all directions that chance alone would bring, by
    how much the cells differ: Ledoit and Wolf 2004, "A well-conditioned estimator for large-dimensional covariance
    matrices", of K vectors √K d_k. Without any cell it is zero.
    """
    spread, unknowns = moves.T @ moves, max(1, moves.shape[1])
    alike = spread.trace() / unknowns * torch.eye(moves.shape[1], dtype=moves.dtype, device=moves.device)
    apart = (spread - alike).square().sum()
    # Σ_k ‖K d_k d_kᵀ − S‖² / K², without the (K, m, m) matrices.
    chance = moves.square().sum(dim=1).square().sum() - spread.square().sum() / max(1, len(moves))
    share = (chance / apart).clamp(max=1.0) if bool(apart > 0.0) else 1.0
    return (1.0 - share) * spread + share * alike


def inflated(model: Tensor, noise: float, inflation: float) -> Tensor:
    """(m, m) σ²I + κ²(V − σ²I)₊ for V = `model` and σ² = `noise`."""
    values, vectors = torch.linalg.eigh(model)
    total = noise + inflation**2 * (values - noise).clamp(min=0.0)
    return (vectors * total) @ vectors.T


def _open(matrix: Tensor, undetermined: Tensor) -> Tensor:
    """The matrix with infinite variance, and no covariance, where nothing is determined."""
    matrix = torch.where(undetermined[:, None] | undetermined[None, :], 0.0, matrix)
    return matrix + torch.diag(torch.where(undetermined, torch.inf, 0.0))
