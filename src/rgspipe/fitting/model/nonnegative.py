"""Least squares with non-negative unknowns, from normal equations of few unknowns: the intensities of a rig."""

from __future__ import annotations

import itertools
from functools import lru_cache

import torch
from torch import Tensor

#: Keeps the equations of lights that look the same solvable, relative to their diagonal.
RIDGE = 1e-13


def nonnegative(gram: Tensor, product: Tensor) -> Tensor:
    """x ≥ 0 that minimises xᵀ G x − 2 hᵀ x, for any number of problems at once.

    Every set of unknowns that may be positive is tried (2ⁿ − 1 of them), and the feasible one of least cost taken,
    so the answer is exact whatever the data.

    Args:
        gram: (…, n, n) float64 G, positive semidefinite; an unknown with a zero diagonal becomes 0.
        product: (…, n) h.

    Returns:
        (…, n) float64.
    """
    if gram.shape[-1] == 1:
        square = gram[..., 0, 0]
        reached = square > 0
        value = torch.where(reached, product[..., 0] / torch.where(reached, square, torch.ones_like(square)), 0.0)
        return value.clamp(min=0.0)[..., None]
    scale = gram.diagonal(dim1=-2, dim2=-1).clamp(min=0.0).sqrt()
    inverse = torch.where(scale > 0, 1.0 / scale.clamp(min=1e-300), torch.zeros_like(scale))
    correlation = gram * inverse[..., :, None] * inverse[..., None, :]
    target = product * inverse
    best = torch.zeros_like(target)
    least = torch.zeros_like(target[..., 0])
    for active in _subsets(gram.shape[-1]):
        chosen = list(active)
        part = correlation[..., chosen, :][..., :, chosen] + RIDGE * torch.eye(len(chosen)).to(gram)
        # A light that reaches nothing has an empty row: its equation becomes x = 0.
        part = part + torch.diag_embed((scale[..., chosen] == 0).to(part))
        wanted = target[..., chosen]
        solved = torch.linalg.solve(part, wanted[..., None])[..., 0]
        cost = -(solved * wanted).sum(dim=-1)
        better = (solved >= 0).all(dim=-1) & (cost < least)
        full = torch.zeros_like(target)
        full[..., chosen] = solved
        best = torch.where(better[..., None], full, best)
        least = torch.where(better, cost, least)
    return best * inverse


@lru_cache(maxsize=16)
def _subsets(count: int) -> tuple[tuple[int, ...], ...]:
    return tuple(subset for size in range(1, count + 1) for subset in itertools.combinations(range(count), size))
