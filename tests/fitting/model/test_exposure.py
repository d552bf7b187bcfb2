"""Views of unknown exposure."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
import torch

from lit_room import HIDDEN, VISIBLE
from rgspipe.fitting import ImageCapture, LightSpec, PaperAdam
from rgspipe.fitting.model.exposure import ExposedMoments, moments_by_view, rough_exposures
from rgspipe.fitting.model.moments import moments

FREE = ImageCapture(exposure_free=True)


def _random_moments(lights: int, exposures: torch.Tensor, seed: int = 0) -> tuple[ExposedMoments, torch.Tensor, tuple]:
    """Moments of views of random images and slopes, with the intensities that made the target, and what they are of."""
    generator = torch.Generator().manual_seed(seed)
    pixels = 60 * len(exposures)
    view_of = torch.arange(pixels) // 60
    columns = [torch.rand((pixels, 3, 4), generator=generator, dtype=torch.float64) for _ in range(lights)]
    intensity = 0.5 + torch.rand((lights, 3), generator=generator, dtype=torch.float64)
    image = sum(part[:, :, 0] * strength for part, strength in zip(columns, intensity, strict=True))
    target = image * exposures[view_of][:, None]
    weights = 0.5 + torch.rand((pixels, 3), generator=generator, dtype=torch.float64)
    system = moments_by_view(columns, target, weights, list(range(0, pixels + 1, 60)))
    return system, intensity, (columns, target, weights, view_of)


@pytest.mark.parametrize("lights", [1, 2])
def test_exposures_and_intensities_are_found_together(lights: int) -> None:
    exposures = torch.tensor([1.0, 0.25, 6.0], dtype=torch.float64)
    system, intensity, _ = _random_moments(lights, exposures)
    torch.testing.assert_close(system.exposures, exposures, rtol=1e-7, atol=0.0)  # measured 2e-10
    torch.testing.assert_close(system.intensity, intensity, rtol=1e-7, atol=0.0)
    assert system.cost < 1e-10


def test_the_system_is_that_of_least_squares_with_everything_eliminated() -> None:
    """Against the Schur complement of the Jacobian towards parameters, intensities and logarithms of exposures."""
    exposures = torch.tensor([1.0, 0.5, 3.0], dtype=torch.float64)
    system, intensity, (columns, _, weights, view_of) = _random_moments(1, exposures)
    root, factor = weights.sqrt(), exposures[view_of][:, None]
    image, slopes = columns[0][:, :, 0] * factor, columns[0][:, :, 1:] * factor[:, :, None]
    by_parameter = [(root * intensity[0] * slopes[:, :, k]).reshape(-1) for k in range(3)]
    by_intensity = [(root * image * torch.eye(3, dtype=torch.float64)[c]).reshape(-1) for c in range(3)]
    by_exposure = [(root * image * intensity[0] * (view_of == v)[:, None]).reshape(-1) for v in (1, 2)]
    wanted, others = torch.stack(by_parameter, dim=1), torch.stack([*by_intensity, *by_exposure], dim=1)
    expected = wanted.T @ (wanted - others @ torch.linalg.lstsq(others, wanted).solution)
    torch.testing.assert_close(system.parameter_system()[0], expected, rtol=1e-6, atol=1e-8)


def test_known_exposures_of_one_are_plain_moments() -> None:
    system, _, (columns, target, weights, _) = _random_moments(1, torch.ones(2, dtype=torch.float64))
    torch.testing.assert_close(system.known.values, moments(columns, target, weights).values, rtol=1e-9, atol=1e-9)


def test_a_dark_view_has_no_exposure_of_its_own_and_nothing_becomes_nan() -> None:
    for dark in itertools.product((0.0, 1.0), repeat=2):
        system, _, _ = _random_moments(1, torch.tensor(dark, dtype=torch.float64))
        assert torch.isfinite(system.exposures).all() and torch.isfinite(system.parameter_system()[0]).all()


def test_rough_exposures_come_from_the_candidate_that_fits_every_view() -> None:
    generator = torch.Generator().manual_seed(3)
    images, views = torch.rand((5, 40, 3), generator=generator), torch.arange(40) // 20
    target = images[3] * torch.tensor([1.0, 2.0, 0.5]) * torch.tensor([1.0, 5.0])[views][:, None]
    found = rough_exposures(images, target, torch.ones(40, 3), views, 2)
    torch.testing.assert_close(found, torch.tensor([1.0, 5.0], dtype=torch.float64), rtol=1e-5, atol=0.0)


@pytest.mark.parametrize("where", [VISIBLE, HIDDEN])
def test_a_light_is_recovered_exactly_from_views_of_unknown_exposure(room, point_light, where) -> None:
    light = point_light(where)
    images = [image * factor for image, factor in zip(room.images(light, 2), (1.0, 3.7), strict=True)]
    result = room.two.fit(images, capture=FREE)
    error = float((result.lights[0].position - light.position).norm())
    assert error < 1e-4, error
    assert result.exposures[1] == pytest.approx(3.7, rel=1e-3)
    torch.testing.assert_close(result.lights[0].intensity, light.intensity, rtol=1e-3, atol=0.0)
    wrong = room.two.fit(images)
    assert float((wrong.lights[0].position - light.position).norm()) > 10.0 * error


def test_two_lights_are_recovered_from_views_of_unknown_exposure(room, point_light) -> None:
    rig = (point_light(VISIBLE), point_light((-0.3, 0.3, 0.2), (0.5, 0.5, 1.5)))
    pairs = zip(room.views, (1.0, 0.4), strict=True)
    images = [room.frozen.render(view, rig, sharp=False) * factor for view, factor in pairs]
    result = replace(room.two, lights=LightSpec(count=2)).fit(images, capture=FREE)
    errors = [min(float((found.position - light.position).norm()) for found in result.lights) for light in rig]
    assert max(errors) < 1e-3, errors
    assert result.exposures[1] == pytest.approx(0.4, rel=1e-2)


def test_one_view_of_unknown_exposure_says_that_intensities_are_relative(room, point_light) -> None:
    result = room.one.fit(room.images(point_light(VISIBLE)), capture=FREE)
    assert "relative to the exposure" in result.reason and result.exposures == (1.0,)


def test_the_published_method_refuses_unknown_exposures(room, point_light) -> None:
    with pytest.raises(ValueError, match="use Search"):
        room.one.fit(room.images(point_light(VISIBLE)), solver=PaperAdam(), capture=FREE)
