"""Conjugate gradients are as near to the solution as their bound says, after as many steps as that calls for."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.optim.conjugate_gradients import conjugate_gradients, steps_to


@settings(deadline=None, max_examples=40)
@given(condition=st.floats(1.0, 1e3), share=st.floats(1e-6, 0.5), seed=st.integers(0, 10_000))
def test_no_more_than_a_share_of_the_error_is_left(condition: float, share: float, seed: int) -> None:
    generator = torch.Generator().manual_seed(seed)
    turned = torch.linalg.qr(torch.randn(40, 40, generator=generator, dtype=torch.float64))[0]
    matrix = turned @ torch.diag(torch.logspace(0.0, float(np.log10(condition)), 40, dtype=torch.float64)) @ turned.T
    true = torch.randn(40, 3, generator=generator, dtype=torch.float64)
    found = conjugate_gradients(lambda x: matrix @ x, matrix @ true, lambda x: x, steps_to(share, condition))
    off = found - true
    left = torch.sqrt((off * (matrix @ off)).sum(dim=0) / (true * (matrix @ true)).sum(dim=0))
    assert float(left.max()) <= share  # 0.7 of it at most in 300 draws


def test_a_solution_is_stood_still_at() -> None:
    """Steps after the last digit change nothing, and a right side of nothing has no solution but nothing."""
    matrix = torch.diag(torch.tensor([1.0, 2.0, 5.0], dtype=torch.float64))
    right = torch.tensor([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]], dtype=torch.float64)
    found = conjugate_gradients(lambda x: matrix @ x, right, lambda x: x, 50)
    torch.testing.assert_close(found[:, 0], right[:, 0] / matrix.diagonal(), rtol=1e-12, atol=0.0)  # 0 off
    assert bool((found[:, 1] == 0.0).all())
