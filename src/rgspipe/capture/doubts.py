"""Where the model of light cannot be trusted: noise of the gather, and edges of shadows.

Beside what pixels say, a measurement of a surfel's albedo has the variance, of its logarithm,

    ( Σ_k (a_k e_k°)² Var_j T_kj + (Σ_j F_ij L_j² − (F L)_i²) / R ) / d_i² :

the transmittance T_k of a lamp varies by so much over the surfel and its neighbours, e_k° what it would send without
shadows, and R rays of the gather have met radiance that varies by so much.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rgspipe.capture.field import Graph
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.photographs import Numbers

#: Neighbours count fully for the variation of shadows above this weight.
BESIDE = 0.2


def model_variance(problem: LampProblem, lamps: Lamps | None, rays: int) -> Numbers:
    """(N,) variance of log L − log d by the model of light alone."""
    arriving = problem.arriving(lamps).mean(axis=1)
    variance = problem.received.uneven / rays
    if lamps is not None:
        gains = np.exp(lamps.logs).mean(axis=1)
        shadowed, open_ = (problem.receivers.irradiance(lamps.places, shadows)[0] for shadows in (True, False))
        for gain, lit, unlit in zip(gains, shadowed, open_, strict=True):
            passing = np.divide(lit, unlit, out=np.ones_like(lit), where=unlit > 0.0)
            variance = variance + (gain * unlit) ** 2 * _variation(problem.field.graph, passing, unlit > 0.0)
    return variance / arriving**2


def _variation(graph: Graph, values: Numbers, counted: np.ndarray) -> Numbers:
    """(N,) variance of `values` (N,) over each surfel and those of its neighbours that are `counted` (N,) bool."""
    near = (graph.weight > BESIDE) & counted[graph.second] & counted[graph.first]
    count = len(values)
    ones = np.ones(int(near.sum()))
    beside = sp.csr_matrix((ones, (graph.first[near], graph.second[near])), (count, count)) + sp.eye(count)
    number = np.asarray(beside.sum(axis=1)).ravel()
    mean = (beside @ values) / number
    return np.maximum((beside @ values**2) / number - mean**2, 0.0)
