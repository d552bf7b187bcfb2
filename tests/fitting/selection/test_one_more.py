"""A number of lights that is too small is told, a right one is not doubted."""

from __future__ import annotations

import pytest
import torch

from lit_room import HIDDEN, VISIBLE
from noisy_fits import SHAPE, THIRD, noisy_fit
from rgspipe.fitting import FitResult, FitStatus, LightSpec
from rgspipe.fitting.findings import LightMissing
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.scene import SpotLight


def told_missing(result: FitResult, count: int) -> bool:
    """Whether one light more than `count` is said to be there."""
    return any(isinstance(finding, LightMissing) and finding.count == count for finding in result.findings)


# Measured shares of the energy that are left: 0.0016 and 0.0083. One more light takes off 83 and 90 % of the cost.
@pytest.mark.parametrize(("place", "strength"), [(HIDDEN, 0.1), (THIRD, 0.15)])
def test_one_light_that_explains_nearly_all_of_two_says_so(room, point_light, place, strength):
    rig = (point_light(VISIBLE), point_light(place, (0.5 * strength, strength, 2.0 * strength)))
    result = noisy_fit(room, rig, LightSpec(count=1))
    assert len(result.lights) == 1 and result.loss < CertaintyOptions().poorly
    assert result.status is FitStatus.UNEXPLAINED and told_missing(result, 1)
    assert result.costs[2] < 0.3 * result.costs[1] and result.lights_tried == 2


def test_two_lights_for_three_say_so(room, point_light):
    rig = (point_light(VISIBLE), point_light(HIDDEN), point_light(THIRD, (0.15, 0.3, 0.45)))
    result = noisy_fit(room, rig, LightSpec(count=2))
    # Measured: 0.7 % of the energy is left, and a third light takes off 89 % of the cost.
    assert result.loss < CertaintyOptions().poorly
    assert result.status is FitStatus.UNEXPLAINED and told_missing(result, 2)
    assert result.costs[3] < 0.3 * result.costs[2]


@pytest.mark.parametrize("places", [(VISIBLE,), (HIDDEN,), (VISIBLE, HIDDEN)])
def test_no_light_more_is_refined_where_the_number_is_right(room, point_light, places):
    result = noisy_fit(room, tuple(point_light(place) for place in places), LightSpec(count=len(places)))
    assert result.status is FitStatus.CONVERGED and result.findings == ()
    assert result.lights_tried == len(places) == max(result.costs)


def test_one_spot_for_two_says_so(room):
    def spot(place: tuple[float, ...], axis: tuple[float, ...], share: float) -> SpotLight:
        direction = torch.nn.functional.normalize(torch.tensor(axis, dtype=torch.float64), dim=0)
        strength, position = share * torch.tensor([1.0, 2.0, 0.5]).double(), torch.tensor(place, dtype=torch.float64)
        return SHAPE.at(position, direction, strength)

    rig = (spot(VISIBLE, (-0.3, 0.5, -0.6), 1.0), spot(THIRD, (0.2, -0.4, -0.7), 0.15))
    result = noisy_fit(room, rig, LightSpec("spot", 1, SHAPE))
    # Measured: 2.8 % of the energy is left, and another spot takes off 77 % of the cost.
    assert result.loss < CertaintyOptions().poorly
    assert result.status is FitStatus.UNEXPLAINED and told_missing(result, 1)
