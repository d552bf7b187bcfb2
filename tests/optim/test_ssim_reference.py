"""Similarity to a fixed image: the value and the derivative of the definition, and no break where both are black."""

from __future__ import annotations

import pytest
import torch

from rgspipe.optim.ssim import ssim
from rgspipe.optim.ssim_reference import SsimReference


def images(brightness: float, dtype: torch.dtype = torch.float64) -> tuple[torch.Tensor, torch.Tensor]:
    """Two images that resemble each other, with a black part in both and one in each."""
    draw = torch.Generator().manual_seed(0)
    target = torch.rand((21, 17, 3), generator=draw, dtype=torch.float64).square()
    image = (target + 0.2 * torch.randn(target.shape, generator=draw, dtype=torch.float64)).clamp(min=0.0)
    target[:9], image[:8], image[9:16, :6] = 0.0, 0.0, 0.0
    return (brightness * image).to(dtype), (brightness * target).to(dtype)


# The image may be brighter than the target, or darker, and both brighter than 1.
@pytest.mark.parametrize(("brightness", "gain"), [(1.0, 1.0), (1.0, 5.0), (20.0, 0.3), (1e-3, 1.0)])
def test_value_and_derivative_are_those_of_the_definition(brightness: float, gain: float) -> None:
    image, target = images(brightness)
    image = (gain * image).requires_grad_()
    expected = ssim(image, target)
    (slope,) = torch.autograd.grad(expected, image)
    found = SsimReference.of(target).similarity(image)
    (own,) = torch.autograd.grad(found, image)
    assert found.item() == pytest.approx(expected.item(), abs=1e-12)
    torch.testing.assert_close(own, slope, rtol=1e-9, atol=1e-12 * float(slope.abs().max()))  # measured 4e-16


def test_derivative_agrees_with_finite_differences() -> None:
    image, target = images(2.0)
    image = 0.5 * image + 0.05
    reference = SsimReference.of(target)
    # The unit is a constant in the derivative, as in the definition: the brightest value of all stays the target's.
    assert float(image.max()) < float(target.max())
    assert torch.autograd.gradcheck(reference.similarity, image.requires_grad_())


@pytest.mark.parametrize("brightness", [0.0, 1e-20, 1.0, 1e13])
def test_single_precision_stays_finite_and_near(brightness: float) -> None:
    image, target = images(brightness, torch.float32)
    found = SsimReference.of(target).similarity(image.requires_grad_())
    (slope,) = torch.autograd.grad(found, image)
    assert torch.isfinite(found) and torch.isfinite(slope).all()
    exact = ssim(image.detach().double(), target.double())
    assert found.item() == pytest.approx(exact.item(), abs=1e-6)  # measured 5e-8


def test_equal_images_have_similarity_one_and_no_slope() -> None:
    _, target = images(1.0)
    other = target.clone().requires_grad_()
    found = SsimReference.of(target).similarity(other)
    (slope,) = torch.autograd.grad(found, other)
    assert found.item() == pytest.approx(1.0, abs=1e-12)
    assert float(slope.abs().max()) < 1e-12  # measured 4e-19


def test_an_image_of_another_size_is_refused() -> None:
    image, target = images(1.0)
    with pytest.raises(ValueError, match="expected an image like"):
        SsimReference.of(target).similarity(image[:5])
