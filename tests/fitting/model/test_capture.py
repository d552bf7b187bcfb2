"""Images of 8 bits: clipped values are censored, rounding is known."""

from __future__ import annotations

import pytest
import torch

from emitters import emitter_at
from lit_room import VISIBLE
from rgspipe.degradation.degraded_views import eight_bit
from rgspipe.fitting import ImageCapture
from rgspipe.fitting.model.capture import rounding_noise, stored_in_eight_bits
from rgspipe.fitting.model.problem import LightProblem


def _clipped(room, light, share: float) -> tuple[list[torch.Tensor], float]:
    images = room.images(light, 2)
    white = float(torch.cat([image.reshape(-1) for image in images]).quantile(1.0 - share))
    return [image.clamp(max=white) for image in images], white


def test_images_of_eight_bits_are_recognised_and_others_are_not() -> None:
    image = torch.rand((16, 16, 3), generator=torch.Generator().manual_seed(0))
    alpha = torch.ones(16, 16)
    assert stored_in_eight_bits(eight_bit(image, 1.0), alpha)
    assert not stored_in_eight_bits(image, alpha) and not stored_in_eight_bits(2.0 * eight_bit(image, 1.0), alpha)
    assert not stored_in_eight_bits(torch.zeros(16, 16, 3), alpha)


def test_rounding_noise_is_that_of_eight_bits() -> None:
    values = 2.0 * torch.rand(200000, generator=torch.Generator().manual_seed(0), dtype=torch.float64) ** 2
    errors = eight_bit(values, 2.0) - values
    # The first range is that of levels 2 to 9.
    for lower, upper in ((0.00092, 0.00576), (0.1, 0.2), (1.0, 1.9)):
        chosen = (values > lower) & (values < upper)
        expected = rounding_noise(values[chosen], torch.tensor(2.0)).square().mean().sqrt()
        assert float(errors[chosen].std()) == pytest.approx(float(expected), rel=0.05)
    assert rounding_noise(values, torch.tensor(torch.inf)).max() == 0.0


def test_a_clipped_value_counts_only_where_the_image_is_darker(room, point_light) -> None:
    light = point_light(VISIBLE)
    images, white = _clipped(room, light, 0.2)
    prepared = room.two.prepared
    problem = LightProblem.create(prepared, prepared.stack_images(images), capture=ImageCapture(clip=white))
    assert 0.1 < float(problem.saturated.double().mean()) < 0.4
    columns = [problem.evaluate(emitter_at(light.position))]
    strength = light.intensity[None] / problem.scale
    assert float(problem.residual(columns, strength).abs().max()) < 1e-4
    dim = problem.residual(columns, 0.5 * strength)
    assert bool((dim[problem.saturated] > 0.0).any())


def test_a_light_is_recovered_exactly_from_clipped_images_and_not_without_knowing_it(room, point_light) -> None:
    light = point_light(VISIBLE)
    images, white = _clipped(room, light, 0.15)
    errors = []
    for capture in (ImageCapture(clip=white), None):
        found = room.two.fit(images, capture=capture).lights[0]
        errors.append(
            (
                float((found.position - light.position).norm()),
                float((found.intensity / light.intensity - 1).abs().max()),
            )
        )
    assert errors[0][0] < 1e-4 and errors[0][1] < 1e-3, errors
    assert errors[1][0] > 10.0 * errors[0][0], errors


def test_eight_bits_cost_little(room, point_light) -> None:
    light = point_light(VISIBLE)
    images = room.images(light, 2)
    white = float(torch.cat([image.reshape(-1) for image in images]).quantile(0.95))
    taken = [eight_bit(image, white) for image in images]
    found = room.two.fit(taken, capture=ImageCapture(clip=white)).lights[0]
    assert float((found.position - light.position).norm()) < 2e-3


def test_images_that_are_white_all_over_do_not_break_a_fit(room) -> None:
    images = [torch.ones(48, 48, 3) for _ in range(2)]
    result = room.two.fit(images, capture=ImageCapture(clip=1.0))
    assert all(
        torch.isfinite(light.position).all() and torch.isfinite(light.intensity).all() for light in result.lights
    )
