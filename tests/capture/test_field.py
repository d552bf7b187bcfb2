"""The field of log-albedo against dense algebra, and against fields that were drawn with known variances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photographed_room import painted_room
from rgspipe.capture.field import Field, Graph, Variances
from rooms import closed_box

VARIANCES = Variances(step=0.05**2, surface=0.4**2, noise=0.1**2)


@pytest.fixture(scope="module")
def graph() -> Graph:
    surfels = closed_box(1 / 7)
    return Graph.of(surfels, np.full((len(surfels), 3), 0.5))


@pytest.fixture(scope="module")
def field(graph: Graph) -> Field:
    rng = np.random.default_rng(0)
    measured = rng.uniform(0.0, 0.02, len(graph.sizes))
    measured[::7] = np.inf
    return Field(graph, measured, rng.uniform(0.2, 1.0, len(measured)), VARIANCES)


def dense(field: Field) -> np.ndarray:
    """Covariance of what was measured, of the surfels that were."""
    kept = field.weight > 0.0
    prior = np.linalg.inv(field.graph.precision(field.variances).toarray())
    return (np.diag(1.0 / np.where(kept, field.weight, 1.0)) + prior)[np.ix_(kept, kept)]


def residual(field: Field, channels: int = 2) -> np.ndarray:
    return np.random.default_rng(1).normal(size=(len(field.weight), channels))


def test_each_wall_is_a_surface_of_its_own(graph: Graph) -> None:
    assert set(graph.sizes) == {49.0}


def test_what_is_left_is_weighed_by_the_whole_covariance(field: Field) -> None:
    kept, r = field.weight > 0.0, residual(field)
    expected = np.linalg.solve(dense(field), r[kept])
    np.testing.assert_allclose(field.whitened(r)[kept], expected, rtol=1e-8, atol=1e-9)
    assert not field.whitened(r)[~kept].any()


def test_differences_of_deviance_are_those_of_the_density(field: Field) -> None:
    r, kept = residual(field), field.weight > 0.0

    def exact(field: Field) -> float:
        covariance = dense(field)
        return sum(float(c @ np.linalg.solve(covariance, c)) for c in r[kept].T) + 2 * np.linalg.slogdet(covariance)[1]

    other = replace(field, variances=Variances(step=0.2, surface=0.3, noise=0.05))
    assert field.deviance(r) - other.deviance(r) == pytest.approx(exact(field) - exact(other), rel=1e-9)


def test_draws_vary_as_the_field_does_after_measurements(field: Field) -> None:
    exact = np.linalg.inv(np.diag(field.weight) + field.graph.precision(field.variances).toarray())
    ratio = field.deviation(400, seed=0) / np.sqrt(np.diag(exact))
    assert np.abs(ratio - 1.0).max() < 0.15  # 0.10: 400 draws are known to 0.035
    assert abs(ratio.mean() - 1.0) < 0.01


def test_variances_are_those_that_a_field_was_drawn_with() -> None:
    surfels = painted_room()
    graph = Graph.of(surfels, np.full((len(surfels), 3), 0.5))
    true = Variances(step=0.05**2, surface=0.4**2, noise=0.08**2)
    rng = np.random.default_rng(0)
    root = np.linalg.cholesky(np.linalg.inv(graph.precision(true).toarray()))
    drawn = root @ rng.normal(size=(len(surfels), 3)) + 0.08 * rng.normal(size=(len(surfels), 3))
    field = Field(graph, np.zeros(len(surfels)), np.ones(len(surfels)), Variances())
    found = field.fitted(drawn)
    assert found.deviance(drawn) <= replace(field, variances=true).deviance(drawn)
    assert found.variances.noise == pytest.approx(true.noise, rel=0.15)
    # What one draw of twelve surfaces tells of their smooth part and of their means.
    assert found.variances.step == pytest.approx(true.step, rel=0.6)
    assert found.variances.surface == pytest.approx(true.surface, rel=0.6)


def test_neighbours_of_other_predicted_paint_are_not_of_one_surface() -> None:
    surfels = closed_box(1 / 7)
    predicted = np.where(surfels.centers[:, :1].numpy() > 0.0, 0.8, 0.2) * np.ones((1, 3))
    assert set(Graph.of(surfels, predicted).sizes) != {49.0}
