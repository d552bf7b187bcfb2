"""Sums that round otherwise, as those of another processor or number of threads do."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import PreparedViews
from rgspipe.renderer.sparse import SparseOperator

#: Images, and what is summed on the way to them, are changed by up to one part in 1e7: less than a last bit of float32
#: up to two of them.
AMOUNT = 1e-7


def round_otherwise(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Change targets, sparse products and what a light shows by at most AMOUNT, each seed in another way.

    The change is a function of the value's own bits, so the same computation still gives the same.
    """

    def changed(function: Callable[..., Tensor]) -> Callable[..., Tensor]:
        return lambda *arguments: _changed(function(*arguments), seed)

    for owner, name in (
        (PreparedViews, "stack_images"),
        (SparseOperator, "__matmul__"),
        (LightProblem, "evaluate"),
    ):
        monkeypatch.setattr(owner, name, changed(getattr(owner, name)))


def _changed(values: Tensor, seed: int) -> Tensor:
    bits = values.float().contiguous().view(torch.int32).double()
    # The low digits of large numbers' sines are as good as random.
    return (values * (1.0 + AMOUNT * torch.sin((12.9898 + seed) * bits))).to(values.dtype)
