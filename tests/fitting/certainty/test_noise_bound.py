"""What noise alone leaves uncertain: fits of noisy images scatter as much, and no fit can scatter less."""

from __future__ import annotations

import math

import pytest
import torch

from lit_room import HIDDEN, VISIBLE
from rgspipe.degradation.degraded_views import noise_deviation
from rgspipe.fitting.certainty.noise_bound import noise_bound
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.search_lm import fit_from
from rgspipe.scene import PointLight


def _deviation(room, light: PointLight, relative: float, views: int = 1) -> torch.Tensor:
    images = [noise_deviation(image, relative).float() for image in room.images(light, views)]
    return (room.one, room.two)[views - 1].prepared.stack_images(images)


def _sd(matrix: torch.Tensor) -> float:
    return float(matrix.diagonal()[:3].sum().sqrt())


def test_fits_of_images_with_that_noise_scatter_as_the_bound_says(room, point_light):
    """The same noise in every value, which least squares that weigh all alike are best for."""
    light, generator = point_light(VISIBLE), torch.Generator().manual_seed(4)
    clean = room.one.prepared.stack_images(room.images(light))
    deviation = torch.full_like(clean, 0.05 * float(clean.mean()))
    (bound,) = noise_bound(room.one, deviation, [light])
    errors = []
    for _ in range(60):
        problem = room.one.problem(clean + deviation * torch.randn(clean.shape, generator=generator))
        errors.append(fit_from(problem, [Emitter.of(light)]).lights[0].position - light.position)
    scatter = torch.stack(errors).square().sum(dim=1).mean().sqrt()
    assert 0.8 < float(scatter) / _sd(bound) < 1.2  # measured 0.93; 1 ± 0.07 expected of sixty


@pytest.mark.parametrize("where", [VISIBLE, HIDDEN])
def test_it_goes_with_the_noise_and_falls_with_more_views(room, point_light, where):
    light = point_light(where)
    (little,) = noise_bound(room.one, _deviation(room, light, 0.01), [light])
    (much,) = noise_bound(room.one, _deviation(room, light, 0.1), [light])
    (both,) = noise_bound(room.two, _deviation(room, light, 0.01, views=2), [light])
    assert _sd(much) == pytest.approx(10.0 * _sd(little), rel=1e-5)  # measured 1e-9
    # Information of views adds up, so no direction is known worse.
    values = torch.linalg.eigvalsh(little[:3, :3] - both[:3, :3])
    assert float(values.min()) > -1e-9 * float(values.max())
    assert _sd(both) < 0.9 * _sd(little)  # measured 0.70 and 0.65


def test_a_light_that_shows_nothing_is_not_determined(room):
    light = PointLight(VISIBLE, 0.0)
    (matrix,) = noise_bound(room.one, torch.zeros(48 * 48, 3), [light])
    assert math.isinf(_sd(matrix)) and not bool(torch.isnan(matrix).any())


def test_two_lights_are_known_no_better_than_each_alone(room, point_light):
    rig = [point_light(VISIBLE), point_light(HIDDEN)]
    deviation = _deviation(room, rig[0], 0.02)
    together = noise_bound(room.one, deviation, rig)
    for light, matrix in zip(rig, together, strict=True):
        (alone,) = noise_bound(room.one, deviation, [light])
        assert _sd(matrix) >= _sd(alone)
