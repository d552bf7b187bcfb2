"""Sparse factors of a field's precision, in memory that comes back."""

from __future__ import annotations

import os
import weakref
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from queue import SimpleQueue

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from rgspipe.capture.photographs import Numbers
from rgspipe.renderer.kernels.launch import thread_count


class Factors:
    """A symmetric positive definite matrix (N, N), factorised; any thread may use it.

    What SciPy's SuperLU takes of memory is only given back by the thread that took it: dropped in another one, factors
    of 22 000 surfels leave 20 to 40 MB behind. So threads of their own make factors, and drop what is no longer needed
    before they make the next.
    """

    def __init__(self, matrix: sp.csc_matrix) -> None:
        idle = _idle()
        maker, dropped = idle.get()
        try:
            self._made = maker.submit(_made, matrix, dropped).result()
        finally:
            idle.put((maker, dropped))
        # Nothing that takes a lock: what is collected may be so while this thread holds it.
        weakref.finalize(self, dropped.append, self._made).atexit = False

    def solve(self, right: Numbers) -> Numbers:
        """(N, K) what the matrix makes `right` (N, K) of."""
        return self._made[0].solve(right)

    def drawn(self, samples: int, seed: int) -> Numbers:
        """(N, samples) draws of a Gaussian field that has the matrix as precision."""
        # With A = P' L U P and U = diag(U) L', what has the covariance A⁻¹ is A⁻¹ P' L √diag(U) times white noise.
        factors = self._made[0]
        white = np.random.default_rng(seed).standard_normal((factors.shape[0], samples))
        return factors.solve((factors.L @ (np.sqrt(factors.U.diagonal())[:, None] * white))[factors.perm_r])

    @property
    def log_determinant(self) -> float:
        """Of the matrix."""
        return float(np.log(np.abs(self._made[0].U.diagonal())).sum())


def _made(matrix: sp.csc_matrix, dropped: deque[list[sp.linalg.SuperLU]]) -> list[sp.linalg.SuperLU]:
    dropped.clear()
    options = {"SymmetricMode": True}
    return [splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)]


@lru_cache(maxsize=1)
def _idle() -> SimpleQueue[tuple[ThreadPoolExecutor, deque[list[sp.linalg.SuperLU]]]]:
    """Executors of one thread each that make nothing at the moment, and what each made and nobody needs."""
    idle: SimpleQueue[tuple[ThreadPoolExecutor, deque[list[sp.linalg.SuperLU]]]] = SimpleQueue()
    for _ in range(thread_count()):
        idle.put((ThreadPoolExecutor(1, "rgspipe-factors"), deque()))
    return idle


# A forked process has none of its parent's threads, and would wait for them for ever.
os.register_at_fork(after_in_child=_idle.cache_clear)
