"""What is measured of a field of log-albedo that is drawn with known variances."""

from __future__ import annotations

import numpy as np

from rgspipe.capture.field import Graph, Variances


def drawn(graph: Graph, rough: np.ndarray, grain: np.ndarray, true: Variances, seed: int = 0) -> np.ndarray:
    """(N, 3) residuals of surfaces that are as rough and as grainy (S,) as that."""
    rng, count = np.random.default_rng(seed), len(graph.sizes)
    root = np.linalg.cholesky(np.linalg.inv(graph.precision(true, rough).toarray()))
    noise = np.sqrt(true.noise * grain[graph.surfaces])[:, None]
    return root @ rng.normal(size=(count, 3)) + noise * rng.normal(size=(count, 3))
