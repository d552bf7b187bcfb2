"""Regions of an answer hold other minima that explain as much, and no more than that."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from rgspipe.fitting.certainty.minima import holding
from rgspipe.fitting.certainty.regions import squared_distance
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.search.refine import State
from rgspipe.scene.lights import Light, PanelLight, PointLight, SpotLight

SCALE, SIZE = 2.0, 3.0


def _state(*lights: Light) -> State:
    intensity = torch.stack([light.intensity for light in lights]).double() / SCALE
    return State(tuple(Emitter.of(light, shape_free=True) for light in lights), (), intensity)


def _point(x: float, power: float = 1.0) -> Light:
    return PointLight(torch.tensor([x, 0.0, 0.0]).double(), power * torch.ones(3).double())


def _numbers(covariance: Tensor, *values: float) -> float:
    """Mahalanobis' squared distance of a change of the first numbers of a light."""
    moved = torch.zeros(len(covariance), dtype=torch.float64)
    moved[: len(values)] = torch.tensor(values)
    return squared_distance(moved, torch.zeros_like(moved), covariance)[0]


@pytest.mark.parametrize("count", [1, 2, 4])
def test_each_of_several_minima_is_within_the_root_of_their_number(count: int) -> None:
    thin = 1e-6 * torch.eye(6, dtype=torch.float64)
    others = [_state(_point(0.1 * (k + 1))) for k in range(count)]
    (covariance,) = holding([thin], _state(_point(0.0)), others, SCALE, SIZE)
    for k in range(count):
        assert _numbers(covariance, 0.1 * (k + 1)) <= count + 1
    # Across, where they do not differ, nothing changes.
    assert covariance[1, 1] == thin[1, 1] and float(covariance[0, 1]) == 0.0


def test_without_others_nothing_changes_and_what_is_open_stays_so() -> None:
    given = torch.diag(torch.tensor([math.inf, 1.0, 1.0, 1.0, 1.0, 1.0]).double())
    (same,) = holding([given], _state(_point(0.0)), [], SCALE, SIZE)
    assert torch.equal(same, given)
    (covariance,) = holding([given], _state(_point(0.0)), [_state(_point(0.1, 3.0))], SCALE, SIZE)
    assert math.isinf(float(covariance[0, 0])) and not torch.isnan(covariance).any()
    assert covariance[3:, 3:].tolist() == (torch.eye(3) + 0.5 * 2.0**2 * torch.ones(3, 3)).tolist()


def test_lights_are_compared_with_their_counterparts() -> None:
    thin = [1e-6 * torch.eye(6, dtype=torch.float64)] * 2
    one, other = _state(_point(0.0), _point(1.0)), _state(_point(1.1), _point(0.0))
    first, second = holding(thin, one, [other], SCALE, SIZE)
    assert torch.equal(first, thin[0])
    assert float(second[0, 0]) == pytest.approx(0.5 * 0.1**2 + 1e-6)


def test_a_panel_of_exchanged_sides_is_the_same_and_its_turn_goes_around() -> None:
    place, down = torch.zeros(3).double(), torch.tensor([0.0, 0.0, -1.0]).double()
    panel = PanelLight(place, torch.ones(3).double(), down, 0.3, 0.2, 0.5 * math.pi - 0.1)
    turned = PanelLight(place, torch.ones(3).double(), down, 0.3, 0.2, 0.1 - 0.5 * math.pi)
    rows = 6 + 3 + 3
    thin = 1e-6 * torch.eye(rows, dtype=torch.float64)
    (same,) = holding([thin], _state(panel), [_state(panel.exchanged)], SCALE, SIZE)
    torch.testing.assert_close(same, thin, rtol=0.0, atol=1e-15)
    (covariance,) = holding([thin], _state(panel), [_state(turned)], SCALE, SIZE)
    assert float(covariance[8, 8]) == pytest.approx(0.5 * 0.2**2 + 1e-6)


def test_of_a_light_of_another_sort_the_place_counts() -> None:
    there, down = torch.tensor([[0.1, 0.0, 0.0], [0.0, 0.0, -1.0]]).double()
    spot = SpotLight(there, torch.ones(3).double(), down, "gaussian", 0.3, 0.1)
    (covariance,) = holding([torch.zeros(6, 6).double()], _state(_point(0.0)), [_state(spot)], SCALE, SIZE)
    assert float(covariance[0, 0]) == pytest.approx(0.5 * 0.1**2)
