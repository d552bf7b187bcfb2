"""Radiance of surfels is measured, whatever single photographs get wrong."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch

from photographed_room import LAMPS, frozen_room, photographs
from rgspipe.capture.photographs import TracedPhotograph
from rgspipe.capture.radiance import PULL, Measured, _normal, measured_radiance
from rgspipe.datasets.views import View
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.training.materials import trace_views

#: Half of the width of a stripe, in a room whose surfels are 0.071 apart.
STRIPE = 0.15


@cache
def weights() -> tuple[ViewWeights, ...]:
    return trace_views(frozen_room().surfels, photographs(), 2)


@cache
def plain() -> Measured:
    return measured_radiance(weights(), photographs())


def truth() -> np.ndarray:
    with torch.no_grad():
        return frozen_room().radiance_of(LAMPS).double().numpy()


def error(found: Measured) -> float:
    """Median relative error of surfels that pixels show."""
    seen = found.seen > 2.0
    assert seen.mean() > 0.7  # 0.74
    return float(np.median(np.abs(found.radiance / truth() - 1.0)[seen]))


def test_it_is_that_of_the_scene() -> None:
    assert error(plain()) < 0.01  # 0.0055


def test_normal_equations_are_solved_to_the_share_that_is_asked_for() -> None:
    """By the bound on their eigenvalues, which no pixel whose weights sum to more than 1 may break."""
    traced = [TracedPhotograph.of(*pair) for pair in zip(weights(), photographs(), strict=True)]
    normal = _normal(traced, [one.base for one in traced])
    scaled = normal.matrix.toarray() / np.sqrt(normal.seen[:, None] * normal.seen)
    values = np.linalg.eigvalsh(scaled)
    assert values.min() >= PULL * (1.0 - 1e-6)  # 1.0: of surfels that nothing shows
    assert values.max() <= 1.0 + PULL  # 1.01
    right = normal.seen[:, None] * truth()
    true = np.linalg.solve(normal.matrix.toarray(), right)
    off = normal.solved(right, 1e-4, np.zeros_like(right)) - true
    left = np.sqrt((off * (normal.matrix @ off)).sum(axis=0) / (true * right).sum(axis=0))
    assert left.max() <= 1e-4  # 3e-6


def test_exposures_follow_from_what_photographs_share() -> None:
    factors = torch.linspace(-0.8, 0.8, 14).exp()
    views = [replace(view, image=view.image * factor) for view, factor in zip(photographs(), factors, strict=True)]
    found = measured_radiance(weights(), views, exposure="free")
    np.testing.assert_allclose(found.cameras.gains, factors.numpy()[:, None].repeat(3, 1), rtol=0.01)  # 0.004
    assert error(found) < 0.01  # 0.0056


def test_white_balance_and_vignetting_follow_from_what_photographs_share() -> None:
    factors = torch.stack([torch.linspace(-s, s, 14).exp() for s in (0.5, -0.2, 0.3)], dim=1)
    views = []
    for view, factor in zip(photographs(), factors, strict=True):
        across = (torch.arange(64) + 0.5 - 32.0) ** 2 / (2.0 * 31.5**2)
        radius = across[:, None] + across
        fallen = (-0.5 * radius - 0.2 * radius**2).exp()[..., None]
        views.append(replace(view, image=view.image * factor * fallen))
    found = measured_radiance(weights(), views, exposure="free_colour", vignetting=True)
    np.testing.assert_allclose(found.cameras.gains, factors.numpy(), rtol=0.05)  # 0.024
    np.testing.assert_allclose(found.cameras.falloff, [-0.5, -0.2], atol=0.08)  # -0.533, -0.205
    assert error(found) < 0.03  # 0.015


def _with_stain(view: View) -> View:
    image = view.image.clone()
    image[20:40, 20:40] = 5.0
    return replace(view, image=image)


def test_what_one_photograph_alone_shows_does_not_count() -> None:
    views = [_with_stain(view) if index == 0 else view for index, view in enumerate(photographs())]
    assert error(measured_radiance(weights(), views)) < 0.01  # 0.0054


def _clipped_at(limits: list[float]) -> tuple[Measured, np.ndarray]:
    """Measured by photographs that are clipped at limits of their own, and (N, 3) what is above the first of them."""
    views = [
        replace(view, image=view.image.clamp(max=limit), saturated_from=limit)
        for view, limit in zip(photographs(), limits, strict=True)
    ]
    above = (truth() > 1.3 * limits[0]) & (plain().seen > 2.0)[:, None]
    assert above.sum() > 20
    return measured_radiance(weights(), views), above


def bright() -> float:
    return float(torch.stack([view.image for view in photographs()]).quantile(0.9))


def test_what_is_saturated_everywhere_is_known_from_below() -> None:
    found, above = _clipped_at([bright()] * 14)
    assert found.blown_out[above].mean() > 0.9
    held = found.blown_out & above
    assert np.median(np.abs(found.radiance[held] / bright() - 1.0)) < 0.02


def test_channels_that_are_not_clipped_are_measured() -> None:
    found, above = _clipped_at([bright()] * 14)
    beside = above.any(axis=1, keepdims=True) & (truth() < 0.8 * bright())
    assert beside.sum() > 20
    assert not found.blown_out[beside].any()
    assert np.median(np.abs(found.radiance / plain().radiance - 1.0)[beside]) < 0.02  # 0.0103


def test_what_is_saturated_in_some_photographs_is_measured_by_the_others() -> None:
    found, above = _clipped_at([bright(), 100.0 * bright()] * 7)
    shown = above & (measured_radiance(weights()[1::2], photographs()[1::2]).seen > 2.0)[:, None]
    assert shown.sum() > 20
    assert found.blown_out[shown].mean() < 0.05
    assert np.median(np.abs(found.radiance / truth() - 1.0)[shown]) < 0.02


def test_the_variance_is_that_of_the_error() -> None:
    generator = torch.Generator().manual_seed(0)
    views = [
        replace(view, image=view.image * (1.0 + 0.1 * torch.randn(view.image.shape, generator=generator)))
        for view in photographs()
    ]
    found = measured_radiance(weights(), views)
    exact = plain()
    seen = found.seen > 5.0
    off = np.log(found.radiance / exact.radiance).mean(axis=1)[seen]
    # The median square of a normal deviate is 0.455.
    ratio = float(np.sqrt(np.median(off**2 / found.variance[seen]) / 0.455))
    # 1.53: pixels that are far off are taken for outliers, and their errors are not counted.
    assert ratio == pytest.approx(1.0, abs=0.8)


def test_a_dark_stripe_of_four_surfels_is_as_dark_as_it_is() -> None:
    """Weighed all alike, bright pixels beside it decide: its surfels came out less than black: -8.7 in the median."""
    surfels = frozen_room().surfels
    wall, height = (surfels.normals[:, 0] > 0.9) & (surfels.centers[:, 0] < -0.4), surfels.centers[:, 2]
    views = []
    for view, weight in zip(photographs(), weights(), strict=True):
        rows = weight.operator.to_scipy()
        on_wall, at = (torch.from_numpy(rows @ part.float().numpy()) for part in (wall, height))
        stripe = ((on_wall > 0.99) & (at.abs() < STRIPE)).reshape(*view.image.shape[:2], 1)
        views.append(replace(view, image=torch.where(stripe, 0.05 * view.image, view.image)))
    inside = (wall & (height.abs() < 0.5 * STRIPE)).numpy() & (plain().seen > 2.0)
    assert inside.sum() > 20  # 28
    found = measured_radiance(weights(), views).radiance[inside]
    assert np.abs(np.log(found / (0.05 * truth()[inside]))).max() < 0.2  # 0.09


def test_photographs_that_are_black_but_for_a_few_pixels_divide_nothing_by_nothing() -> None:
    """No quantile tells what is bright where more than 99 % of the pixels are black."""
    sent = torch.zeros(len(frozen_room().surfels), 3)
    sent[np.abs(plain().seen - 10.0).argmin()] = 1.0
    views = [replace(view, image=weight.image(sent)) for view, weight in zip(photographs(), weights(), strict=True)]
    assert torch.stack([view.image for view in views]).quantile(0.99) == 0.0
    with np.errstate(divide="raise", invalid="raise"):
        found = measured_radiance(weights(), views)
    assert np.isfinite(found.radiance).all()
