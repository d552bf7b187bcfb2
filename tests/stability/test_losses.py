"""Losses, masks and bounds of the fits in hard cases, in float32 against float64."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

import double_precision
from hard_cases import INSIDE, a_few, camera
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews
from rgspipe.fitting.baselines.paper_adam_loss import AdamLoss, MovingRig
from rgspipe.fitting.baselines.paper_adam_start import Ball, light_ball
from rgspipe.fitting.model.views import PreparedViews, prepare_views
from rgspipe.optim.ssim import ssim
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight


@pytest.fixture(scope="module")
def views(frozen: FrozenScene) -> PreparedViews:
    """Two views of one light."""
    return prepare_views(frozen, [frozen.view(camera(name)) for name in ("plain", "in a surfel")])


LIGHT = PointLight(INSIDE, torch.ones(3, dtype=torch.float64))

IMAGES = {
    "black": lambda image: torch.zeros_like(image),
    "flat": lambda image: torch.full_like(image, 0.7),
    "one bright pixel": lambda image: torch.where(image == image.max(), 1e12 * image, image),
    "1e-20": lambda image: 1e-20 * image,
    "1e13": lambda image: 1e13 * image,
    "1e19": lambda image: 1e19 * image,
    "16 orders": lambda image: image * torch.logspace(-8, 8, len(image)).to(image)[:, None, None],
}


@pytest.mark.parametrize("second", IMAGES)
@pytest.mark.parametrize("first", IMAGES)
def test_structural_similarity(first: str, second: str, within) -> None:
    """Value and gradient for any pair of images, also a pair of equal ones."""
    plain = torch.rand((17, 13, 3), generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    results = []
    for dtype, function in ((torch.float32, ssim), (torch.float64, double_precision.ssim)):
        image = IMAGES[first](plain).to(dtype).requires_grad_()
        value = function(image, IMAGES[second](plain).to(dtype))
        value.backward()
        results.append((value[None], image.grad))
    # A value between −1 and 1; the gradient is that towards the logarithm of each pixel.
    within("value", results[0][0], results[1][0], 1e-5, least=1.0)
    by_logarithm = (IMAGES[first](plain) * gradient.double() for _, gradient in results)
    within("gradient", *by_logarithm, 1e-5, least=1.0)


def loss_and_gradients(views: PreparedViews, target: Tensor) -> list[Tensor]:
    leaves = [(INSIDE + 0.1).requires_grad_(), torch.zeros(3, dtype=torch.float64, requires_grad=True)]
    loss = AdamLoss(views, target, 0.2, Effects())(MovingRig(*(leaf[None] for leaf in leaves), PointLight.shaped()))
    loss.backward()
    return [loss.detach(), *(leaf.grad for leaf in leaves)]


def test_masks_all_zero_make_a_loss_of_nothing(frozen: FrozenScene, views: PreparedViews) -> None:
    target = torch.cat([frozen.render(view, (LIGHT,), sharp=False).reshape(-1, 3) for view in views.views])
    nowhere = replace(views, masks=tuple(torch.zeros_like(mask) for mask in views.masks))
    for value in loss_and_gradients(nowhere, target):
        # 1 − SSIM of two black images: measured 0.
        assert float(value.abs().max()) <= 1e-6


def test_a_view_whose_mask_is_zero_leaves_the_others_to_decide(frozen: FrozenScene, views: PreparedViews) -> None:
    target = torch.cat([frozen.render(view, (LIGHT,), sharp=False).reshape(-1, 3) for view in views.views])
    one = replace(views, masks=(views.masks[0], torch.zeros_like(views.masks[1])))
    alone = prepare_views(frozen, [views.views[0]])
    half = [0.5 * value for value in loss_and_gradients(alone, target[: views.views[0].camera.pixel_count])]
    for found, expected in zip(loss_and_gradients(one, target), half, strict=True):
        torch.testing.assert_close(found, expected.to(found), rtol=1e-5, atol=1e-7)


def test_a_fit_with_masks_all_zero_says_so(frozen: FrozenScene, views: PreparedViews) -> None:
    masks = [torch.zeros(16, 16) for _ in views.views]
    with pytest.raises(InputError, match="0 of 512"):
        FitViews.prepare(frozen, views.views, masks=masks, sharp=False)


def test_a_search_with_one_mask_zero_finds_the_light(frozen: FrozenScene, views: PreparedViews) -> None:
    images = [frozen.render(view, (LIGHT,), sharp=False) for view in views.views]
    masks = [torch.ones(16, 16), torch.zeros(16, 16)]
    prepared = FitViews.prepare(frozen.with_dictionary(5), views.views, masks=masks, sharp=False)
    fit = prepared.fit([images[0], torch.full_like(images[1], 1e9)])
    # Measured 2e-8.
    assert float((fit.lights[0].position - INSIDE).norm()) < 1e-3


@pytest.mark.parametrize("distance", [0.0, 1.0, 1.0 - 1e-16, 1.0 + 1e-15, 1e3, 1e150])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3])
def test_the_ball_keeps_what_is_in_it_and_brings_back_what_is_not(distance: float, radius: float) -> None:
    center = torch.tensor([0.3, -2.0, 1.0], dtype=torch.float64)
    direction = torch.tensor([0.6, 0.0, 0.8], dtype=torch.float64)
    ball, position = Ball(center, radius), center + distance * radius * direction
    projected = ball.project(position)
    assert torch.isfinite(projected).all()
    assert float((projected - center).norm()) <= radius * (1.0 + 1e-12)
    if distance <= 1.0:
        torch.testing.assert_close(projected, position, rtol=0, atol=1e-12 * radius)
    else:
        assert ball.at_bound(projected)
        torch.testing.assert_close((projected - center) / radius, direction, rtol=0, atol=1e-9)
    # Twice is once, to rounding.
    torch.testing.assert_close(ball.project(projected), projected, rtol=0, atol=1e-12 * radius)


def test_the_ball_of_one_surfel_and_no_training_light_is_a_point() -> None:
    frozen = FrozenScene.freeze(a_few(1), gather_rays=4, patches=1, seed=0)
    ball, radius = light_ball(frozen, None)
    assert radius == 0.0 and torch.isfinite(ball.project(INSIDE)).all()
