"""Compositing of rays through hard scenes: weights and what passes, in float32 against float64."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from double_precision import in_double
from hard_cases import DEEP, FEW, GEOMETRIES, SCENES, rays
from rgspipe.renderer import reference
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh


def dense_weights(indices: Tensor, weights: Tensor, columns: int) -> Tensor:
    matrix = torch.zeros(len(indices), columns, dtype=torch.float64)
    ray, column = (indices >= 0).nonzero(as_tuple=True)
    return matrix.index_put_((ray, indices[ray, column].long()), weights[ray, column].double(), accumulate=True)


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("name", GEOMETRIES)
def test_weights_and_what_passes(name: str, two_sided: bool, within) -> None:
    scene = SCENES[name]
    surfels, (origins, directions) = scene.build(), rays(scene, FEW if name in DEEP else 200)
    nearest = 1e-4 * scene.size
    hits = composite(SurfelBvh(surfels), origins, directions, nearest, two_sided)
    weights, passing = reference.composite_dense(in_double(surfels), origins, directions, nearest, two_sided)
    found = dense_weights(hits.indices, hits.weights, len(surfels))
    if name == "coincident duplicates":  # which of two equal surfels comes first is a matter of rounding
        half = len(surfels) // 2
        found, weights = found[:, :half] + found[:, half:], weights[:, :half] + weights[:, half:]
    # Measured at most 9e-7 and 2e-6, and 2e-4 in single rays past needles.
    within("weights", found, weights, 2e-6, outliers=1e-3, cap=5e-4)
    within("passing", hits.transmittance, passing, 2e-5, outliers=2e-2, cap=5e-4)
    assert float(found.sum(dim=1).max() if len(surfels) else 0.0) <= 1.0 + 1e-5
