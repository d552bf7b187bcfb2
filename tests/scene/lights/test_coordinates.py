"""How fits move fields of lights: steps, their units, and the way back, for every coordinate."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from rgspipe.scene.lights.coordinates import AXIS, PLACE, BeforePlane, Coordinate, OnPlane, tangents
from rgspipe.scene.lights.shape_coordinates import Between, Positive, Ratio

SIZE = 2.5
BETWEEN, POSITIVE, RATIO = Between(0.02, 1.5), Positive(0.01, 1.0), Ratio(0.5, 1000.0)

FOOT, UP = (torch.tensor(values, dtype=torch.float64) for values in ([0.3, -0.2, 0.1], [0.0, 0.6, 0.8]))
BEFORE = BeforePlane(FOOT, UP, 0.002, 0.15)

components = st.floats(-1.0, 1.0)
vectors = st.tuples(components, components, components).map(lambda v: torch.tensor(v, dtype=torch.float64))
axes = vectors.filter(lambda v: float(v.norm()) > 0.1).map(lambda v: v / v.norm())


def before(place: Tensor, distance: float) -> Tensor:
    """A place so far before the plane of `BEFORE`."""
    return place + (distance - (place - FOOT) @ UP) * UP


#: A coordinate and a value that has room to move to both sides.
inside = st.one_of(
    st.tuples(st.just(PLACE), vectors),
    st.tuples(st.just(AXIS), axes),
    st.tuples(st.just(OnPlane(UP)), vectors),
    st.tuples(st.just(BEFORE), st.tuples(vectors, st.floats(0.01, 0.3)).map(lambda pair: before(*pair))),
    st.tuples(st.just(BETWEEN), st.floats(0.05, 1.4)),
    st.tuples(st.just(POSITIVE), st.floats(0.02, 0.9)),
    st.tuples(st.just(RATIO), st.floats(0.6, 900.0)),
)


def steps(coordinate: Coordinate, length: float) -> Tensor:
    """(2 d, d) steps of a length, each along one parameter, forth and back."""
    one = torch.eye(coordinate.count, dtype=torch.float64)
    return length * torch.cat([one, -one])


def as_vector(value: Tensor | float) -> Tensor:
    return torch.as_tensor(value, dtype=torch.float64).reshape(-1)


@settings(deadline=None)
@given(inside)
def test_an_offset_is_the_step_that_leads_there(case: tuple[Coordinate, Tensor | float]) -> None:
    coordinate, value = case
    for step in steps(coordinate, 1e-4):
        back = coordinate.offset(value, coordinate.moved(value, step, SIZE), SIZE)
        # Second order: measured 5e-9, of a logit.
        torch.testing.assert_close(back, step, rtol=0.0, atol=2e-8)


@settings(deadline=None)
@given(inside)
def test_units_are_the_derivatives_of_steps(case: tuple[Coordinate, Tensor | float]) -> None:
    coordinate, value = case
    ahead, behind = (
        torch.stack([as_vector(coordinate.moved(value, step, SIZE)) for step in part])
        for part in steps(coordinate, 1e-4).chunk(2)
    )
    expected = coordinate.spread(value) * torch.tensor(coordinate.units(value, SIZE), dtype=torch.float64)
    # Over the largest: measured 2e-9.
    difference = ((ahead - behind) / 2e-4).T - expected
    assert float(difference.abs().max()) < 1e-7 * max(1.0, float(expected.abs().max()))


@settings(deadline=None)
@given(inside)
def test_no_step_moves_nothing_and_distances_are_those_of_steps(case: tuple[Coordinate, Tensor | float]) -> None:
    coordinate, value = case
    still = coordinate.moved(value, torch.zeros(coordinate.count, dtype=torch.float64), SIZE)
    # Measured 2e-16.
    torch.testing.assert_close(as_vector(still), as_vector(value), rtol=1e-14, atol=1e-15)
    assert coordinate.distance(value, value, SIZE) == 0.0
    for step in steps(coordinate, 1e-3):
        other = coordinate.moved(value, step, SIZE)
        there, back = coordinate.distance(value, other, SIZE), coordinate.distance(other, value, SIZE)
        assert there == pytest.approx(back) and there > 0.0
        assert sum(coordinate.stretch(step)) == pytest.approx(1e-3)


@settings(deadline=None)
@given(inside)
def test_slopes_follow_the_chain_rule(case: tuple[Coordinate, Tensor | float]) -> None:
    """Of any linear function of the field."""
    coordinate, value = case
    spread = coordinate.spread(value)
    by = torch.randn(4, len(spread), generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    found = coordinate.slopes(value, by if by.shape[1] > 1 else by[:, 0])
    torch.testing.assert_close(found, by @ spread)


@settings(deadline=None)
@given(axes)
def test_tangents_are_orthonormal_and_across(axis: Tensor) -> None:
    basis = torch.cat([tangents(axis), axis[None]])
    # Measured 4e-16.
    torch.testing.assert_close(basis @ basis.T, torch.eye(3, dtype=torch.float64), rtol=0, atol=1e-14)


@settings(deadline=None)
@given(axes, st.tuples(components, components))
def test_changes_of_an_axis_are_the_same_in_the_tangents_of_another(axis: Tensor, turn: tuple[float, float]) -> None:
    """To first order in how far apart they are; tangents themselves may jump."""
    other = AXIS.moved(axis, 1e-3 * torch.tensor(turn, dtype=torch.float64), SIZE)
    turned = AXIS.turned(axis, other)
    step = torch.tensor([0.3, -0.7], dtype=torch.float64)
    # Measured 9e-4 and 1e-6.
    torch.testing.assert_close(AXIS.spread(other) @ turned @ step, AXIS.spread(axis) @ step, rtol=0, atol=3e-3)
    torch.testing.assert_close(turned @ turned.T, torch.eye(2, dtype=torch.float64), rtol=0, atol=1e-5)


@settings(deadline=None)
@given(axes, st.floats(0.0, 3.0), st.floats(0.0, 2.0 * math.pi))
def test_a_turn_is_as_long_as_its_step(axis: Tensor, angle: float, around: float) -> None:
    step = angle * torch.tensor([math.cos(around), math.sin(around)], dtype=torch.float64)
    turned = AXIS.moved(axis, step, SIZE)
    assert float(turned.norm()) == pytest.approx(1.0, abs=1e-14)
    found = math.atan2(float(torch.linalg.cross(axis, turned).norm()), float(axis @ turned))
    assert found == pytest.approx(angle, abs=1e-12)  # measured 7e-16


@settings(deadline=None)
@given(st.sampled_from([BETWEEN, POSITIVE, RATIO]), st.floats(0.0, 2000.0), st.floats(-1e6, 1e6))
def test_steps_of_any_length_from_anywhere_stay_in_bounds(coordinate: Between, value: float, step: float) -> None:
    moved = coordinate.moved(value, torch.tensor([step], dtype=torch.float64), SIZE)
    assert coordinate.low <= moved <= coordinate.high
    (unit,) = coordinate.units(moved, SIZE)
    assert unit > 0.0 and math.isfinite(unit)


@settings(deadline=None)
@given(st.floats(1.0, 500.0), st.floats(0.5, 2.0))
def test_ratios_tell_how_much_a_number_changed_where_only_they_count(value: float, factor: float) -> None:
    assert RATIO.distance(value, factor * value, SIZE) == pytest.approx(abs(math.log(factor)), abs=1e-12)
    assert POSITIVE.distance(0.3, 0.5, SIZE) == pytest.approx(0.2)


def test_a_scene_of_no_size_has_no_room_to_move_in() -> None:
    place, other = torch.zeros(3, dtype=torch.float64), torch.ones(3, dtype=torch.float64)
    assert PLACE.distance(place, other, 0.0) == 0.0
    assert PLACE.offset(place, other, 0.0).tolist() == [0.0] * 3


@settings(deadline=None)
@given(vectors, st.floats(0.0, 1.0), vectors)
def test_no_step_leads_away_from_a_plane_or_behind_it(place: Tensor, distance: float, step: Tensor) -> None:
    moved = BEFORE.moved(before(place, distance), 10.0 * step, SIZE)
    assert 0.002 * SIZE - 1e-12 <= float((moved - FOOT) @ UP) <= 0.15 * SIZE + 1e-12
