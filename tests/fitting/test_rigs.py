"""Several lights, spots, mixed rigs and unknown numbers, in the model's own images."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from lit_room import HIDDEN, VISIBLE
from rgspipe.errors import InputError
from rgspipe.fitting import FitResult, FitStatus, FitViews, LightSpec
from rgspipe.scene import LightRig, SpotLight

THIRD = (-0.3, 0.3, 0.1)
SHAPE = SpotLight.shaped("smoothstep", math.radians(30.0), 0.3)


def spot(position=VISIBLE, axis=(-0.3, 0.5, -0.6), shape: SpotLight = SHAPE) -> SpotLight:
    direction = torch.nn.functional.normalize(torch.tensor(axis, dtype=torch.float64), dim=0)
    place, intensity = torch.tensor(position, dtype=torch.float64), torch.tensor([1.0, 2.0, 0.5]).double()
    return shape.at(place, direction, intensity)


def fit(room, rig: LightRig, spec: LightSpec, noise: float = 0.0, sharp: bool = False) -> FitResult:
    views = FitViews.prepare(room.frozen, room.views, lights=spec, sharp=sharp)
    generator = torch.Generator().manual_seed(0)
    images = [
        image + noise * image.mean() * torch.randn(image.shape, generator=generator) for image in views.render(rig)
    ]
    return views.fit(images)


def errors(result: FitResult, rig: LightRig) -> tuple[float, float]:
    """The largest distance and relative error of intensity, each true light against the nearest found."""
    distances, ratios = [], []
    for light in rig:
        found = min(result.lights, key=lambda other, x=light.position: float((other.position - x).norm()))
        distances.append(float((found.position - light.position).norm()))
        ratios.append(float((found.intensity / light.intensity - 1).abs().max()))
    return max(distances), max(ratios)


def assert_sound(result: FitResult) -> None:
    """Every covariance is finite, symmetric and has no negative variance."""
    assert len(result.covariance) == len(result.lights)
    for matrix in result.covariance:
        assert torch.isfinite(matrix).all() and float(matrix.diagonal().min()) >= 0.0
        torch.testing.assert_close(matrix, matrix.T)


def test_two_point_lights_one_of_them_hidden(room, point_light):
    rig = (point_light(VISIBLE), point_light(HIDDEN, (0.5, 0.5, 1.0)))
    result = fit(room, rig, LightSpec(count=2))
    # Measured 3e-8 and 2e-7.
    assert max(errors(result, rig)) < 1e-5 and result.status is FitStatus.CONVERGED
    assert len(result.lights) == result.lights_tried == 2 and set(result.costs) == {1, 2}
    assert_sound(result)


def test_a_spot_with_known_cone_where_pixels_look(room):
    result = fit(room, (spot(),), LightSpec("spot", shape=SHAPE), sharp=True)
    (found,) = result.lights
    # Measured 7e-8 and 1e-7.
    assert max(errors(result, (spot(),))) < 1e-5 and isinstance(found, SpotLight)
    assert float((found.direction - spot().direction).norm()) < 1e-5
    assert (found.cone_angle, found.falloff) == (SHAPE.cone_angle, SHAPE.falloff)
    assert result.covariance[0].shape == (9, 9)
    assert_sound(result)


@pytest.mark.parametrize("lights", [1, 2])
def test_the_number_of_lights_is_found(room, point_light, lights):
    rig = (point_light(VISIBLE), point_light(HIDDEN, (0.5, 0.5, 1.0)))[:lights]
    result = fit(room, rig, LightSpec(count=None), noise=0.02)
    assert len(result.lights) == lights and set(result.costs) == set(range(1, lights + 2))
    assert errors(result, rig)[0] < 0.01
    assert result.lights_tried == lights + 1


def test_one_light_for_two_is_no_answer(room, point_light):
    """With half of the image unexplained the fit does not say that it has converged, and says what may be wrong."""
    rig = (point_light(VISIBLE), point_light(THIRD, (0.2, 1.0, 2.0)))
    result = fit(room, rig, LightSpec(count=1))
    # Unexplained: 20 % of the energy, measured.
    assert result.loss > 0.1 and result.status is FitStatus.UNEXPLAINED and "number or type" in result.reason


def _random_spot(seed: int) -> SpotLight:
    draw = np.random.default_rng(seed)
    return spot(tuple(draw.uniform(-0.35, 0.35, 3)), tuple(draw.normal(size=3)))


@pytest.mark.parametrize("seed", [0, 8, 12])
def test_random_spots_are_found(room, seed):
    """Rims make many minima."""
    rig = (_random_spot(seed),)
    result = fit(room, rig, LightSpec("spot", 1, SHAPE))
    # Measured 3e-8, 3e-8 and 9e-8. Of twenty seeds fifteen are found, to 4e-7; numbers 6, 16 and 18 say ambiguous,
    # undetermined and unexplained, and number 10 is found in the end, after all its steps. Numbers 3 and 17 are off by
    # 0.009 and 0.011: another place makes the same image to within float32's rounding.
    assert result.status is FitStatus.CONVERGED and errors(result, rig)[0] < 1e-5


def test_a_spot_that_another_explains_as_well_is_ambiguous(room):
    """The views see nothing of where it shines but what bounces off: a spot 0.6 away gives the same.

    Both that and that nothing is determined is said, whether the search met such a spot or not: three of six did.
    """
    result = fit(room, (_random_spot(6),), LightSpec("spot", 1, SHAPE))
    assert result.status is FitStatus.AMBIGUOUS and result.loss < 1e-6
    assert "Not determined by these views: position and axis and intensity." in result.reason


def _ill_images(room, kind: str) -> list[Tensor]:
    if kind == "black":
        return [torch.zeros(48, 48, 3)] * 2
    if kind == "saturated":
        return [torch.ones(48, 48, 3)] * 2
    hot = torch.zeros(48, 48, 3)
    hot[20, 20] = 1e4
    return [hot, hot]


@pytest.mark.parametrize("kind", ["black", "saturated", "one hot pixel"])
def test_images_that_no_rig_explains_stay_finite(room, kind):
    spec = LightSpec(count=2)
    views = FitViews.prepare(room.frozen, room.views, lights=spec, sharp=False)
    result = views.fit(_ill_images(room, kind))
    assert result.lights or result.status is FitStatus.NOT_ENOUGH_LIGHT
    assert bool(result.lights) or kind != "saturated"
    assert np.isfinite(result.loss) and result.reason
    for light in result.lights:
        assert torch.isfinite(light.position).all() and torch.isfinite(light.intensity).all()


def test_impossible_wishes_are_refused():
    with pytest.raises(InputError, match=r"LightSpec\.type"):
        LightSpec("lamp")
    with pytest.raises(InputError, match=r"LightSpec\.count"):
        LightSpec(count=9)
