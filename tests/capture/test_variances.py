"""Variances that a field and its noise were drawn with, and surfaces and surfels that differ from the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drawn_fields import drawn
from photographed_room import painted_room
from rgspipe.capture.field import Field, Graph, Variances
from rgspipe.capture.variances import with_likely_variances

TRUE = Variances(step=0.05**2, surface=0.4**2, noise=0.08**2)


@pytest.fixture(scope="module")
def graph() -> Graph:
    surfels = painted_room()
    return Graph.of(surfels, np.full((len(surfels), 3), 0.5))


def unknown(graph: Graph) -> Field:
    return Field(graph, np.zeros(len(graph.sizes)), np.ones(len(graph.sizes)), Variances())


def alike(graph: Graph) -> np.ndarray:
    return np.ones(graph.surfaces.max() + 1)


def test_variances_are_those_that_a_field_was_drawn_with(graph: Graph) -> None:
    residual = drawn(graph, alike(graph), alike(graph), TRUE)
    found = with_likely_variances(unknown(graph), residual)
    assert found.variances.noise == pytest.approx(TRUE.noise, rel=0.15)  # 1.03
    # What one draw of twelve surfaces tells of their smooth part and of their means.
    assert found.variances.step == pytest.approx(TRUE.step, rel=0.6)  # 0.97
    assert found.variances.surface == pytest.approx(TRUE.surface, rel=0.6)  # 0.83


def test_paint_that_changes_slowly_has_little_of_bends_and_leaves_steps_free(graph: Graph) -> None:
    """Steps ten times as wide as bends: a field of steps alone would have to take both for one."""
    true = Variances(0.5**2, TRUE.surface, 0.02**2, 0.05**2)
    residual = drawn(graph, alike(graph), alike(graph), true)
    found = with_likely_variances(unknown(graph), residual)
    assert found.variances.bend == pytest.approx(true.bend, rel=0.6)  # 0.89
    assert found.variances.step == pytest.approx(true.step, rel=0.6)  # 1.20
    steps = with_likely_variances(replace(unknown(graph), graph=replace(graph, bent=None)), residual)
    assert found.deviance(residual) < steps.deviance(residual) - 100.0


@pytest.mark.parametrize(("rough", "grain"), [(36.0, 1.0), (1.0, 36.0)])
def test_a_wall_that_differs_is_told_from_plain_ones(graph: Graph, rough: float, grain: float) -> None:
    """Paint that is rough on one wall, and noise that is: the other walls, of 196 surfels each, stay as they are."""
    walls = np.bincount(graph.surfaces) > 100
    factors = np.where(np.arange(len(walls)) == walls.argmax(), np.array([[rough], [grain]]), 1.0)
    residual, found = drawn(graph, *factors, TRUE), unknown(graph)
    for _ in range(3):  # as a search does, which goes on from them
        found = with_likely_variances(found, residual)
    true = replace(found, variances=TRUE, rough=factors[0], grain=factors[1])
    # 0.3 and 6.4 above it, of 3816 measurements: each surface is drawn to the others.
    assert found.deviance(residual) < true.deviance(residual) + 10.0
    step, noise = found.variances.step * found.rough, found.variances.noise * found.grain
    own, plain = walls.argmax(), walls & (factors.max(axis=0) == 1.0)
    if rough > 1.0:
        assert step[own] > 4.0 * step[plain].max()  # 5.3: beside noise one draw tells little of steps
    else:
        assert noise[own] == pytest.approx(grain * TRUE.noise, rel=0.3)  # 1.00
    np.testing.assert_allclose(noise[plain], TRUE.noise, rtol=0.3)  # 0.08


def test_what_no_other_surfel_says_counts_little(graph: Graph) -> None:
    residual = drawn(graph, alike(graph), alike(graph), TRUE)
    residual[100] += 20.0 * np.sqrt(TRUE.noise)
    trust = with_likely_variances(unknown(graph), residual, trusting=True).trust
    assert trust[100] < 0.05  # 0.010
    assert np.median(trust) == pytest.approx(1.0, rel=0.1)  # 1.006
