"""Regions are drawn as large as they are: the mesh lies on the surface within which a lamp is with 95 %."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy.stats import chi2

from rgspipe.viewer.ellipsoids import LEAST, MOST, region

PLACE = torch.tensor([0.1, -0.2, 0.3], dtype=torch.float64)

#: Of χ² with three degrees of freedom.
QUANTILE = float(chi2.ppf(0.95, 3))


def covariance(scale: float = 0.01) -> torch.Tensor:
    """Of a position, tilted, and of an intensity, which does not matter."""
    random = torch.randn(4, 4, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    return scale**2 * (random @ random.T + torch.eye(4))


def test_the_mesh_lies_on_the_surface_of_the_region() -> None:
    vertices, _ = region(PLACE, covariance(), 1.0)
    away = vertices - PLACE.numpy()
    distance = np.einsum("vi,ij,vj->v", away, np.linalg.inv(covariance()[:3, :3].numpy()), away)
    np.testing.assert_allclose(distance, QUANTILE, rtol=1e-9)


def test_the_mesh_is_closed_and_holds_its_volume() -> None:
    vertices, faces = region(PLACE, covariance(), 1.0)
    a, b, c = (vertices[faces[:, corner]] - PLACE.numpy() for corner in range(3))
    volume = abs(np.einsum("fi,fi->f", a, np.cross(b, c)).sum()) / 6.0
    whole = 4.0 / 3.0 * math.pi * math.sqrt(QUANTILE**3 * float(torch.linalg.det(covariance()[:3, :3])))
    # Flat faces cut 5 % of it off: measured 0.947.
    assert 0.9 < volume / whole < 1.0


@pytest.mark.parametrize("unknown", [math.inf, math.nan])
def test_what_is_not_known_is_drawn_long(unknown: float) -> None:
    """Not as a point, as if it were known exactly."""
    block = covariance()
    block[1, :] = block[:, 1] = unknown
    vertices, _ = region(PLACE, block, 2.0)
    reach = np.abs(vertices - PLACE.numpy()).max(axis=0)
    assert np.isfinite(vertices).all()
    # The rings have no vertex straight along an axis: measured 3.98.
    assert 0.95 * 2.0 * MOST < reach[1] <= 2.0 * MOST and reach[0] < 0.2


def test_what_is_known_exactly_can_still_be_seen() -> None:
    vertices, _ = region(PLACE, torch.zeros(3, 3, dtype=torch.float64), 2.0)
    away = np.linalg.norm(vertices - PLACE.numpy(), axis=1)
    np.testing.assert_allclose(away, 2.0 * LEAST, rtol=1e-9)
