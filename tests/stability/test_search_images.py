"""Hypothesis looks for hard images: the similarity of any two, and the normal equations of any light."""

from __future__ import annotations

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

import double_precision
from rgspipe.fitting.certainty.uncertainty import whitener
from rgspipe.fitting.model.moments import moments
from rgspipe.optim.ssim import ssim

search = settings(max_examples=100, derandomize=True, deadline=None, database=None)


@search
@given(
    height=st.integers(1, 14),
    width=st.integers(1, 14),
    exponents=st.tuples(st.floats(-15.0, 15.0), st.floats(-15.0, 15.0)),
    spread=st.floats(0.0, 8.0),
    equal=st.booleans(),
)
def test_similarity_of_any_images(
    height: int, width: int, exponents: tuple[float, float], spread: float, equal: bool
) -> None:
    """Value against float64, and a finite gradient, for images of any brightness and range of brightness."""
    generator = torch.Generator().manual_seed(0)
    logs = torch.rand(2, height, width, 3, generator=generator, dtype=torch.float64)
    first, second = 10.0 ** (spread * (logs - 0.5) + torch.tensor(exponents)[:, None, None, None])
    second = first if equal else second
    image = first.float().requires_grad_()
    value = ssim(image, second.float())
    value.backward()
    assert torch.isfinite(image.grad).all()
    assert abs(float(value.detach()) - float(double_precision.ssim(first, second))) < 1e-4


@search
@given(
    pixels=st.integers(1, 20),
    exponents=st.tuples(*[st.floats(-12.0, 12.0)] * 3),
    dark=st.lists(st.booleans(), min_size=3, max_size=3),
    flat=st.booleans(),
)
def test_normal_equations_of_any_image(
    pixels: int, exponents: tuple[float, float, float], dark: list[bool], flat: bool
) -> None:
    """Intensity, Gauss-Newton system and covariance are finite for few pixels, dark channels and flat derivatives."""
    generator = torch.Generator().manual_seed(0)
    columns = torch.rand(pixels, 3, 4, generator=generator) * 10.0 ** exponents[0]
    columns[..., 1:] *= 0.0 if flat else 10.0 ** exponents[1]
    columns = columns * ~torch.tensor(dark)[None, :, None]
    target = torch.rand(pixels, 3, generator=generator) * 10.0 ** exponents[2]
    system = moments([columns], target, torch.ones(pixels, 1))
    matrix, direction = system.parameter_system()
    root, unknown = whitener(system.information(system.intensity))
    spread = root @ root.T
    for value in (system.intensity, matrix, direction, spread):
        assert torch.isfinite(value).all()
    assert float(system.intensity.min()) >= 0.0
    assert float(system.intensity[:, torch.tensor(dark)].sum()) == 0.0
    # A light that does not reach a channel has an intensity there that nothing determines.
    assert bool(unknown[3:][torch.tensor(dark)].all())
