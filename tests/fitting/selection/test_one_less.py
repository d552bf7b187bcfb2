"""A number of lights that is too large is told, with the light that may not be there; a right one is not doubted."""

from __future__ import annotations

import pytest
import torch

from emitters import emitter_at
from lit_room import HIDDEN, VISIBLE
from noisy_fits import SHAPE, THIRD, noisy_fit, noisy_images
from rgspipe.fitting import FitResult, FitStatus, FitViews, LightSpec
from rgspipe.fitting.findings import LightSpare
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import BarOptions
from rgspipe.fitting.search.refine import Refiner
from rgspipe.fitting.search.weighting import ROBUST
from rgspipe.fitting.selection.one_less import one_light_less


def said_to_be_too_many(result: FitResult) -> bool:
    told = [finding for finding in result.findings if isinstance(finding, LightSpare)]
    return result.status is FitStatus.AMBIGUOUS and [finding.count for finding in told] == [len(result.lights)]


@pytest.mark.parametrize("place", [VISIBLE, HIDDEN, THIRD])
def test_two_lights_for_one_say_so(room, point_light, place):
    result = noisy_fit(room, (point_light(place),), LightSpec(count=2))
    assert len(result.lights) == 2 and said_to_be_too_many(result)
    assert 1.0 - result.costs[2] / result.costs[1] < 0.1  # measured at most 0.015


def test_three_lights_for_two_say_so(room, point_light):
    result = noisy_fit(room, (point_light(VISIBLE), point_light(HIDDEN)), LightSpec(count=3))
    assert len(result.lights) == 3 and said_to_be_too_many(result)


def test_two_spots_for_one_say_so(room):
    axis = torch.nn.functional.normalize(torch.tensor((-0.3, 0.5, -0.6), dtype=torch.float64), dim=0)
    strength, position = torch.tensor([1.0, 2.0, 0.5]).double(), torch.tensor(VISIBLE, dtype=torch.float64)
    spot = SHAPE.at(position, axis, strength)
    assert said_to_be_too_many(noisy_fit(room, (spot,), LightSpec("spot", 2, SHAPE)))


@pytest.mark.parametrize("places", [(VISIBLE, HIDDEN), (HIDDEN, THIRD), (VISIBLE, HIDDEN, THIRD)])
def test_a_right_number_is_not_doubted(room, point_light, places):
    count = len(places)
    result = noisy_fit(room, tuple(point_light(place) for place in places), LightSpec(count=count))
    assert result.status is FitStatus.CONVERGED and set(result.costs) == {count - 1, count}
    assert 1.0 - result.costs[count] / result.costs[count - 1] > 2.0 * BarOptions().least  # measured at least 0.919


def test_the_light_that_is_spare_is_named_and_the_others_take_its_part(room, point_light):
    """Of a light that is split in two one half is left out, though each is far from faint."""
    views = FitViews.prepare(room.frozen, room.views, sharp=False)
    images = noisy_images(views, (point_light(VISIBLE), point_light(HIDDEN)))
    problem = LightProblem.create(views.prepared, views.prepared.stack_images(images))
    beside = (VISIBLE[0] + 0.05, *VISIBLE[1:])
    places = [HIDDEN, VISIBLE, beside]
    emitters = [emitter_at(torch.tensor(place, dtype=torch.float64)) for place in places]
    refiner = Refiner.of(problem)
    found = one_light_less(refiner, refiner.start(emitters, ROBUST), BarOptions())
    assert not found.worth and found.index in (1, 2) and found.gain < 0.1  # measured 0.001
    assert [len(state.emitters) for state in (found.rich, found.simple)] == [3, 2]
    nearest = min(float((one.position - emitters[1].position).norm()) for one in found.simple.emitters)
    assert nearest < 0.005  # measured 0.0004
