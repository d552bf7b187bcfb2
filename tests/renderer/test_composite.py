"""Compositing against its float64 reference: weights, hits without number, places far away."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from clouds import DEVICES, FAR, cloud, cloud_rays, moved, one_full_layer, rays_down, reordered, thousand_faint_layers
from rgspipe.renderer import reference
from rgspipe.renderer.kernels.composite import USUAL_HITS, Hits, composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Surfels


def dense(hits: Hits, columns: int) -> Tensor:
    indices, weights = hits.indices.cpu(), hits.weights.cpu()
    matrix = torch.zeros(len(indices), columns, dtype=torch.float64)
    ray, column = (indices >= 0).nonzero(as_tuple=True)
    index = (ray, indices[ray, column].long())
    return matrix.index_put_(index, weights[ray, column].double(), accumulate=True)


def bvh_of(surfels: Surfels, device: str = "cpu") -> SurfelBvh:
    return SurfelBvh(surfels.to(torch.float32).to(device))


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("two_sided", [False, True])
def test_weights_match_the_reference(two_sided: bool, device: str) -> None:
    surfels, rays = cloud(200, seed=0), cloud_rays(300, seed=1)
    hits = composite(bvh_of(surfels, device), *rays, two_sided=two_sided)
    weights, passing = reference.composite_dense(surfels, *rays, two_sided=two_sided)
    # Measured 4.5e-6 and 1.2e-5 (two-sided): float32 in depth decides α near the edge of a footprint.
    torch.testing.assert_close(dense(hits, 200), weights, atol=5e-5, rtol=0)
    torch.testing.assert_close(hits.transmittance.double().cpu(), passing, atol=5e-5, rtol=0)
    assert float(passing.min()) < 0.05, "the scene must hold opaque rays for this to prove anything"


def test_weights_sum_to_what_is_stopped() -> None:
    hits = composite(bvh_of(cloud(200, seed=2)), *cloud_rays(300, seed=3))
    # Measured 1.5e-7.
    torch.testing.assert_close(hits.weights.sum(dim=1), 1.0 - hits.transmittance, atol=2e-6, rtol=0)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("build", [thousand_faint_layers, one_full_layer])
def test_no_hit_is_lost(build, device: str) -> None:
    surfels, rays = build(), rays_down(12)
    hits = composite(bvh_of(surfels, device), *rays)
    weights, passing = reference.composite_dense(surfels, *rays)
    count = int((weights > 0).sum(dim=1).amin())
    assert count > 4 * USUAL_HITS and float(passing.min()) > 0.02, "rays must meet more than a row holds, and pass"
    # Measured 7e-9 and 1.3e-7.
    torch.testing.assert_close(dense(hits, len(surfels)), weights, atol=1e-6, rtol=0)
    torch.testing.assert_close(hits.transmittance.double().cpu(), passing, atol=5e-6, rtol=0)


def test_only_rays_that_need_them_get_wider_rows() -> None:
    surfels = thousand_faint_layers()
    origins, directions = rays_down(4)
    aside = origins + torch.tensor([3.0, 0.0, 0.0])
    assert composite(bvh_of(surfels), aside, directions).indices.shape[1] == USUAL_HITS
    mixed = composite(bvh_of(surfels), torch.cat([origins, aside]), directions.repeat(2, 1))
    assert mixed.indices.shape[1] > 4 * USUAL_HITS
    assert bool((mixed.indices[4:] == -1).all()) and float(mixed.weights[4:].abs().max()) == 0.0
    alone = composite(bvh_of(surfels), origins, directions)
    torch.testing.assert_close(mixed.weights[:4], alone.weights, atol=0, rtol=0)


def test_the_order_of_surfels_does_not_matter() -> None:
    surfels, rays = cloud(200, seed=0), cloud_rays(100, seed=1)
    order = torch.randperm(200, generator=torch.Generator().manual_seed(2))
    expected = dense(composite(bvh_of(surfels), *rays), 200)[:, order]
    # Measured 1.8e-7: sums in another order.
    torch.testing.assert_close(
        dense(composite(bvh_of(reordered(surfels, order)), *rays), 200), expected, atol=2e-6, rtol=0
    )


def test_far_from_the_origin_float64_places_keep_their_digits() -> None:
    surfels, (origins, directions) = cloud(200, seed=0), cloud_rays(300, seed=1)
    weights, _ = reference.composite_dense(surfels, origins, directions)
    far = dense(composite(SurfelBvh(moved(surfels, FAR)), origins + FAR, directions), 200)
    # Measured 5.2e-6; at the origin 4.5e-6.
    torch.testing.assert_close(far, weights, atol=5e-5, rtol=0)
    rounded = dense(composite(bvh_of(moved(surfels, FAR)), origins + FAR, directions), 200)
    assert float((rounded - weights).abs().max()) > 1e-3, "float32 places are too coarse here"
