"""Fixed points from a few iterates."""

from __future__ import annotations

import torch
from torch import Tensor

#: Part of the way to the least-squares solution that a round goes where the light that bounces is held.
DAMPING = 0.45

#: Rounds that the next one is mixed from, and how little their differences may count.
MIXED, MIXING_RIDGE = 3, 1e-4


class Mixing:
    """The next iterate of a fixed point x = g(x), from the last few (Anderson 1965), each channel on its own.

    Args:
        step: part of the way to g(x) that is gone; alone it would be plain damping.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._pairs: list[tuple[Tensor, Tensor]] = []

    def next(self, x: Tensor, found: Tensor) -> Tensor:
        """The iterate after x (N, C), whose image g(x) is `found`."""
        self._pairs = [*self._pairs, (x, found - x)][-MIXED:]
        places, misses = (torch.stack(part, dim=-1) for part in zip(*self._pairs, strict=True))
        if len(self._pairs) == 1:
            return x + self._step * misses[..., -1]
        steps, changes = places.diff(dim=-1), misses.diff(dim=-1)
        # (C, K, K) and (C, K): what combination of the changes cancels the miss best.
        normal = torch.einsum("nck,ncl->ckl", changes, changes).double()
        right = torch.einsum("nck,nc->ck", changes, misses[..., -1]).double()
        ridge = MIXING_RIDGE * normal.diagonal(dim1=1, dim2=2).mean(dim=1)[:, None, None]
        share = torch.linalg.solve(normal + (ridge + 1e-30) * torch.eye(normal.shape[1]).to(normal), right).to(x)
        change = torch.einsum("nck,ck->nc", steps + self._step * changes, share)
        return x + self._step * misses[..., -1] - change
