"""Losses in units of the peak, compressed, and over windows; what a step draws."""

from __future__ import annotations

import math

import pytest
import torch

from rgspipe.scene import Camera, look_at
from rgspipe.training.loss import compressed, image_loss
from rgspipe.training.options import ImageLossOptions
from rgspipe.training.sampling import draw_pixels, draw_window, pixel_means, views_of_step

IMAGE = torch.rand(16, 16, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
OTHER = torch.rand(16, 16, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)


@pytest.mark.parametrize("kind", ["l2", "l1", "l1_ssim"])
def test_brightness_of_a_scene_does_not_matter_and_equal_images_cost_nothing(kind: str) -> None:
    options = ImageLossOptions(kind, compression=10.0)
    loss = image_loss(IMAGE, OTHER, 1.0, options, window=True)
    scaled = image_loss(1e6 * IMAGE, 1e6 * OTHER, 1e6, options, window=True)
    torch.testing.assert_close(scaled, loss, rtol=1e-9, atol=0.0)
    assert float(image_loss(IMAGE, IMAGE, 1.0, options, window=True)) == pytest.approx(0.0, abs=1e-12)


def test_compression_keeps_zero_and_peak_and_weighs_dark_errors_more() -> None:
    values = torch.tensor([0.0, 0.01, 1.0, -0.01], dtype=torch.float64)
    found = compressed(values, 10.0)
    assert float(found[0]) == 0.0
    assert float(found[2]) == pytest.approx(1.0)
    assert float(found[3]) == -float(found[1])
    assert float(found[1]) == pytest.approx(math.log(1.1) / math.log(11.0))
    assert torch.equal(compressed(values, 0.0), values)


@pytest.mark.parametrize("kind", ["l2", "l1_ssim"])
def test_losses_have_the_gradient_of_finite_differences(kind: str) -> None:
    leaf = IMAGE.clone().requires_grad_()
    options = ImageLossOptions(kind, compression=5.0)
    # Measured below 1e-8.
    assert torch.autograd.gradcheck(lambda x: image_loss(x, OTHER, 0.7, options, True), leaf, fast_mode=True)


def test_ssim_refuses_pixels_that_stand_alone() -> None:
    with pytest.raises(ValueError, match="window"):
        image_loss(IMAGE.reshape(-1, 3), OTHER.reshape(-1, 3), 1.0, ImageLossOptions("l1_ssim"), window=False)


def camera() -> Camera:
    eye, target = torch.tensor([0.0, -1.0, 0.0]), torch.zeros(3)
    return Camera.from_field_of_view(look_at(eye, target), 1.0, 20, 12)


def test_rays_of_a_window_average_to_its_pixels() -> None:
    edges = torch.zeros(240).bool()
    edges[::7] = True
    draw = draw_window(camera(), edges, 8, 3, torch.Generator().manual_seed(3))
    assert draw.shape == (8, 8)
    assert len(draw.origins) == 9 * int(edges[draw.pixels].sum()) + int((~edges[draw.pixels]).sum())
    # The mean direction of a pixel's rays is its centre's; measured 1.2e-4, as unit vectors lie on a sphere.
    _, centre, _ = camera().rays(draw.pixels)
    torch.testing.assert_close(pixel_means(draw, draw.directions), centre.float(), atol=1e-3, rtol=0.0)


def test_single_pixels_are_as_many_as_asked_for_of_either_kind() -> None:
    edges = torch.zeros(240).bool()
    edges[:50] = True
    draw = draw_pixels(camera(), edges, 30, 1000, 2, torch.Generator().manual_seed(3))
    assert int(edges[draw.pixels].sum()) == 30
    assert len(draw.pixels) == 30 + 190
    assert len(draw.pixels.unique()) == len(draw.pixels)
    torch.testing.assert_close(pixel_means(draw, torch.ones(len(draw.origins), 1)), torch.ones(220, 1))


def test_every_view_comes_up_once_an_epoch() -> None:
    seen = [view for step in range(4) for view in views_of_step(12, 3, seed=5, step=step)]
    assert sorted(seen) == list(range(12))
    assert views_of_step(12, 3, 5, 4) != views_of_step(12, 3, 5, 0) or views_of_step(12, 3, 5, 5) != seen[3:6]
