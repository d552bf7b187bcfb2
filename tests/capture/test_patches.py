"""Patches of other paint and outliers, drawn on the walls of a room with a known field and known noise."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drawn_fields import drawn
from photographed_room import painted_room
from rgspipe.capture.field import Field, Graph, Variances
from rgspipe.capture.patches import with_patches
from rgspipe.capture.variances import with_likely_variances

TRUE = Variances(step=0.03**2, surface=0.4**2, noise=0.05**2)
ROOM = painted_room()


@cache
def graph() -> Graph:
    return Graph.of(ROOM, np.full((len(ROOM), 3), 0.5))


def on_a_wall(size: int, *, thin: bool = False) -> np.ndarray:
    """Surfels around the middle of the largest wall: a square patch, or a line of them."""
    own = np.flatnonzero(graph().surfaces == np.bincount(graph().surfaces).argmax())
    places = ROOM.centers[own].double().numpy()
    away = np.abs(places - places.mean(axis=0))
    across, along = np.argsort(away.max(axis=0))[1:]
    row = np.isclose(places[:, across], places[away[:, across].argmin(), across])
    far = np.where(row, away[:, along], np.inf) if thin else away.max(axis=1)
    return own[np.argsort(far, kind="stable")[:size]]


def plain(seed: int = 0, *, rough: float = 1.0, grain: float = 1.0) -> np.ndarray:
    """(N, 3) what is measured of walls of which the largest is as rough and as grainy as that."""
    surfaces = np.bincount(graph().surfaces)
    factors = np.where(np.arange(len(surfaces)) == surfaces.argmax(), np.array([[rough], [grain]]), 1.0)
    return drawn(graph(), *factors, TRUE, seed=seed)


def with_outliers(residual: np.ndarray, beside: np.ndarray, seed: int = 1) -> np.ndarray:
    """Forty single ones, of any size."""
    rng = np.random.default_rng(seed)
    chosen = np.setdiff1d(rng.choice(len(ROOM), 40, replace=False), beside)
    residual = residual.copy()
    residual[chosen] += rng.normal(size=(len(chosen), 1))
    return residual


def settled(residual: np.ndarray, measured: np.ndarray | None = None) -> Field:
    """The field as a search leaves it."""
    count = len(ROOM)
    measured = np.zeros(count) if measured is None else measured
    field = Field(graph(), measured, np.isfinite(measured).astype(float), Variances())
    for _ in range(3):
        field = with_likely_variances(field, residual, trusting=True)
    return field


@pytest.mark.parametrize("jump", [-2.5, -0.5])
@pytest.mark.parametrize("size", [16, 49, 80])
def test_a_patch_of_other_paint_has_its_own(size: int, jump: float) -> None:
    own = on_a_wall(size)
    true = plain()
    true[own] += jump
    residual = with_outliers(true, own)
    before = settled(residual)
    after, doubt = with_patches(before, residual, ROOM)
    assert len(np.unique(after.graph.surfaces)) == len(np.unique(before.graph.surfaces)) + 1
    off = [np.sqrt(((field.mean_colours(residual) - true)[own] ** 2).mean()) for field in (before, after)]
    assert off[1] < 0.07, off  # 0.043 to 0.051, and 0.09 to 2.5 before: single measurements have 0.05 of noise
    rest = np.setdiff1d(np.arange(len(ROOM)), own)
    assert np.sqrt(((after.mean_colours(residual) - true)[rest] ** 2).mean()) < 0.07  # 0.055
    assert np.sqrt(doubt[own]).max() < 0.05  # 0.0000


@pytest.mark.parametrize("size", [1, 2, 9])
def test_single_outliers_and_thin_lines_of_them_are_no_paint(size: int) -> None:
    residual = plain()
    residual[on_a_wall(size, thin=True)] -= 2.5
    residual = with_outliers(residual, on_a_wall(size, thin=True))
    before = settled(residual)
    after, _ = with_patches(before, residual, ROOM)
    assert after is before


@pytest.mark.parametrize(("rough", "grain"), [(1.0, 1.0), (36.0, 1.0), (1.0, 36.0)])
@pytest.mark.parametrize("seed", range(3))
def test_even_paint_and_rough_paint_have_no_patches(seed: int, rough: float, grain: float) -> None:
    residual = plain(seed, rough=rough, grain=grain)
    before = settled(residual)
    after, _ = with_patches(before, residual, ROOM)
    assert after is before


def test_what_was_not_measured_along_a_rim_ties_no_patch_to_what_is_around_it() -> None:
    own, rim = on_a_wall(25), np.setdiff1d(on_a_wall(49), on_a_wall(25))
    residual = plain()
    residual[own] -= 2.5
    measured = np.zeros(len(ROOM))
    measured[rim[::2]] = np.inf
    field, _ = with_patches(settled(residual, measured), residual, ROOM)
    off = (field.mean_colours(residual) - residual)[own]
    assert np.sqrt((off**2).mean()) < 0.07  # 0.047
    assert len(np.unique(field.graph.surfaces[own])) == 1
    assert not np.isin(field.graph.surfaces[on_a_wall(196)[-49:]], field.graph.surfaces[own]).any()


def test_what_is_measured_badly_along_a_rim_ties_no_patch_to_what_is_around_it() -> None:
    """It is as like to what is on either side of it: of a band of a cupboard, a few of them were enough."""
    own, rim = on_a_wall(25), np.setdiff1d(on_a_wall(49), on_a_wall(25))
    residual, measured = plain(), np.zeros(len(ROOM))
    residual[own] -= 2.5
    residual[rim] -= 1.25
    measured[rim] = 0.7**2
    field, _ = with_patches(settled(residual, measured), residual, ROOM)
    off = (field.mean_colours(residual) - residual)[own]
    assert np.sqrt((off**2).mean()) < 0.07  # 0.047; 0.64 if they are compared
    assert len(np.unique(field.graph.surfaces[own])) == 1
    assert not np.isin(field.graph.surfaces[on_a_wall(196)[-49:]], field.graph.surfaces[own]).any()


def test_a_channel_that_is_clipped_makes_no_patch() -> None:
    """Its values are known from below alone, and what is around it tells them."""
    own, true = on_a_wall(49), plain()
    residual, told = true.copy(), np.ones((len(ROOM), 3), dtype=bool)
    residual[own, 0] -= 1.5
    told[own, 0] = False
    field = Field(graph(), np.zeros(len(ROOM)), np.ones(len(ROOM)), Variances(), told=told)
    field = with_likely_variances(field, residual, trusting=True)
    assert with_patches(field, residual, ROOM)[0] is field
    # Others are paint, which has that channel, too, at the rim.
    residual[own, 1:] -= 1.5
    told[on_a_wall(16), 0] = True
    after, _ = with_patches(replace(field, told=told), residual, ROOM)
    assert len(np.unique(after.graph.surfaces)) == len(np.unique(field.graph.surfaces)) + 1


def test_a_patch_that_may_as_well_be_outliers_is_in_doubt() -> None:
    """Whichever is taken, the other's value is within some deviations of it."""
    own = on_a_wall(4)
    for jump in (-0.5, -2.5):
        residual = plain()
        residual[own] += jump
        before = settled(residual)
        _, doubt = with_patches(before, residual, ROOM)
        assert (doubt[np.setdiff1d(np.arange(len(ROOM)), own)] < 0.01).all()  # 0.0000
        assert 0.01 < np.sqrt(doubt[own]).max() < abs(jump)  # 0.21, 0.13


@settings(max_examples=5, deadline=None)
@given(level=st.floats(-3.0, 3.0), seed=st.integers(0, 99))
def test_what_all_measurements_share_makes_no_patches(level: float, seed: int) -> None:
    residual = plain(seed)
    residual[on_a_wall(25)] -= 1.0
    field = settled(residual)
    surfaces = [with_patches(field, residual + shift, ROOM)[0].graph.surfaces for shift in (0.0, level)]
    np.testing.assert_array_equal(*surfaces)
