"""Factors solve, draw and know their determinant, and give their memory back whichever thread drops them."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from rgspipe.capture.factors import Factors


def grid(side: int) -> sp.csc_matrix:
    """Precision of a field on side² places that is tied to 0 a little."""
    line = sp.diags([-1.0, 2.1, -1.0], [-1, 0, 1], shape=(side, side))
    return (sp.kronsum(line, line) @ sp.kronsum(line, line)).tocsc()


def test_they_are_those_of_the_matrix() -> None:
    matrix = grid(12)
    factors, dense = Factors(matrix), matrix.toarray()
    right = np.random.default_rng(0).normal(size=(144, 3))
    np.testing.assert_allclose(factors.solve(right), np.linalg.solve(dense, right), rtol=1e-9)  # 3e-12
    assert factors.log_determinant == pytest.approx(np.linalg.slogdet(dense)[1], rel=1e-12)  # 7e-16


def test_draws_have_the_inverse_as_covariance() -> None:
    matrix = grid(6)
    drawn, covariance = Factors(matrix).drawn(20_000, 0), np.linalg.inv(matrix.toarray())
    off = drawn @ drawn.T / 20_000 - covariance
    # Each of them is known to √2 over the root of the draws, 1 % of a variance.
    assert np.abs(off).max() < 0.05 * covariance.max()  # 0.027


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the system does not say how much memory is in use")
def test_memory_comes_back_when_another_thread_drops_them() -> None:
    """Factors of SciPy that one thread makes and another drops stay: 7 MB each of this matrix."""
    matrix = grid(80)

    def resident() -> float:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

    def made_elsewhere() -> None:
        with ThreadPoolExecutor(2) as pool:
            kept = list(pool.map(lambda _: Factors(matrix), range(4)))
            assert all(one.log_determinant == kept[0].log_determinant for one in kept)

    made_elsewhere()
    before = resident()
    for _ in range(5):
        made_elsewhere()
    assert resident() - before < 40.0  # -16 to 7, and 146 with plain ones
