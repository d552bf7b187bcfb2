"""Sums of many numbers in one order, however many threads add them.

torch cuts the sum of a large tensor into as many parts as it has threads, so its last bits would tell a laptop from a
server, and a sweep of several jobs from a plain run; so would everything that is decided by them.
"""

from __future__ import annotations

import torch
from torch import Tensor

#: Numbers that are added in one go. torch adds up to 32768 in one thread.
CHUNK = 4096


def total(values: Tensor) -> Tensor:
    """The sum of all values, a scalar; differentiable."""
    flat = values.reshape(-1)
    while len(flat) > CHUNK:
        whole = len(flat) // CHUNK * CHUNK
        parts = flat[:whole].view(-1, CHUNK).sum(dim=1)
        flat = torch.cat([parts, flat[whole:].sum()[None]])
    return flat.sum()


def average(values: Tensor) -> Tensor:
    """The mean of all values, a scalar; differentiable. NaN without any, as torch has it."""
    return total(values) / values.numel()
