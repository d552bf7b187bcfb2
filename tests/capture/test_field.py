"""The field of log-albedo against dense algebra, and against fields that were drawn with known variances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

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
    ratio = field.deviation(10_000, seed=0) / np.sqrt(np.diag(exact))
    assert np.abs(ratio - 1.0).max() < 0.04  # 0.022: 10 000 draws are known to 0.007
    assert abs(ratio.mean() - 1.0) < 0.01


def test_each_surface_is_as_rough_and_as_grainy_as_is_said_of_it(field: Field) -> None:
    """Against the density with one step and one noise, of the surface alone, as surfaces are apart."""
    factors = np.ones(field.graph.surfaces.max() + 1)
    factors[2] = 9.0
    own, measured = field.graph.surfaces == 2, np.where(np.isfinite(field.measured), 0.0, np.inf)
    varied = replace(field, measured=measured, rough=factors, grain=factors)
    wide = Variances(9 * VARIANCES.step, VARIANCES.surface, 9 * VARIANCES.noise, 9 * VARIANCES.bend)
    alike = replace(field, measured=measured, variances=wide)
    r = residual(field) * own[:, None]
    np.testing.assert_allclose(varied.whitened(r)[own], alike.whitened(r)[own], rtol=1e-9, atol=1e-9)
    plain = replace(field, measured=measured)
    np.testing.assert_allclose(varied.weight[~own], plain.weight[~own])


def test_paint_that_changes_evenly_along_a_wall_has_steps_and_no_bends(graph: Graph) -> None:
    """Up to the edges of each wall and into its corners: nothing ties paint to be level there."""
    centers = closed_box(1 / 7).centers.numpy()
    ramp = (centers @ np.random.default_rng(3).normal(size=(3, 2))) + graph.surfaces[:, None]
    assert graph.bends(ramp).max() < 1e-12 < graph.steps(ramp).min()
    waves = np.sin(9.0 * centers)
    assert graph.bends(waves).min() > 1.0  # 8.3


def test_neighbours_of_other_predicted_paint_are_not_of_one_surface() -> None:
    surfels = closed_box(1 / 7)
    predicted = np.where(surfels.centers[:, :1].numpy() > 0.0, 0.8, 0.2) * np.ones((1, 3))
    assert set(Graph.of(surfels, predicted).sizes) != {49.0}


def test_channels_that_are_told_apart_are_fields_of_their_own(field: Field) -> None:
    """Each is as one of which only those surfels were measured, and other captures may know more of one."""
    rng, numbers = np.random.default_rng(2), residual(field, 3)
    told, known = rng.random(numbers.shape) < 0.7, rng.uniform(0.0, 50.0, numbers.shape)
    apart = replace(field, told=told, known=known)
    alone = [
        replace(field, measured=np.where(own, field.measured, np.inf), known=elsewhere)
        for own, elsewhere in zip(told.T, known.T, strict=True)
    ]
    columns = np.split(numbers, 3, axis=1)
    for channel, (own, column) in enumerate(zip(alone, columns, strict=True)):
        np.testing.assert_allclose(apart.whitened_colours(numbers)[:, channel : channel + 1], own.whitened(column))
        np.testing.assert_allclose(apart.mean_colours(numbers)[:, channel : channel + 1], own.mean(column))
    total = sum(own.deviance(column) for own, column in zip(alone, columns, strict=True))
    assert apart.deviance(numbers) == pytest.approx(total, rel=1e-9)
    assert apart.measurements == sum(own.measurements for own in alone) // 3


def test_surfaces_that_touch_keep_their_own_albedo_however_even_they_are() -> None:
    """Weak ties of neighbours around a corner were as strong as the paint is even: 26 surfels that reflect 0.7 were
    taken for outliers on a dark thing beside them."""
    chain = np.array([(i, i + 1) for i in range(39) if i != 19])
    pairs = np.concatenate([chain, [(i, i + 20) for i in range(20)]])
    weight = np.repeat([1.0, 0.04], [len(chain), 20])
    first, second = np.concatenate([pairs, pairs[:, ::-1]]).T
    graph = Graph(first, second, np.tile(weight, 2), np.repeat([0, 1], 20))
    field = Field(graph, np.zeros(40), np.ones(40), Variances(step=0.005**2, surface=0.35**2, noise=0.03**2))
    true = np.repeat([0.0, -1.0], 20)
    measured = (true + 0.03 * np.random.default_rng(0).normal(size=40))[:, None]
    assert np.abs(field.mean(measured)[:, 0] - true).max() < 0.05  # 0.012; 0.38 by the paint's own step
