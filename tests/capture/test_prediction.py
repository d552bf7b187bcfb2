"""A predicted albedo is believed as far as the light agrees with it."""

from __future__ import annotations

import numpy as np

from rgspipe.capture.field import Field, Graph, Variances
from rgspipe.capture.prediction import Prediction

COUNT = 120


def graph() -> Graph:
    """Three surfaces of 40 surfels in a row each."""
    first = np.array([i for i in range(COUNT - 1) if (i + 1) % 40])
    return Graph(first, first + 1, np.ones(len(first)), np.arange(COUNT) // 40)


def field() -> Field:
    return Field(graph(), np.full(COUNT, 0.02**2), np.ones(COUNT), Variances(0.02**2, 0.3**2, 0.01**2))


def paint() -> np.ndarray:
    """(N, 3) of three surfaces."""
    return np.log(np.array([0.7, 0.1, 0.4]))[np.arange(COUNT) // 40][:, None].repeat(3, axis=1)


def shading() -> np.ndarray:
    """(N, 3) a smooth error."""
    return 0.2 * np.sin(np.arange(COUNT) / 9.0)[:, None].repeat(3, axis=1)


def test_its_parts_are_the_whole() -> None:
    albedo = np.exp(paint() + shading())
    np.testing.assert_allclose(Prediction.of(albedo, graph()).with_shares(1.0, 1.0), albedo, rtol=1e-12)


def test_shading_is_not_believed_where_the_light_has_it_otherwise() -> None:
    prediction = Prediction.of(np.exp(paint() + shading()), graph())
    noise = 0.02 * np.random.default_rng(0).standard_normal((COUNT, 3))
    found = np.log(prediction.believed(field(), paint() + noise))
    assert np.abs(found - found[np.arange(COUNT) // 40 * 40]).max() < 0.02  # 0.0147
    off = (found - paint())[::40]
    assert np.abs(off - off.mean()).max() < 0.1  # 0.068


def test_texture_is_believed_where_the_light_has_it_too() -> None:
    prediction = Prediction.of(np.exp(paint() + shading()), graph())
    found = np.log(prediction.believed(field(), paint() + shading()))
    np.testing.assert_allclose(found, paint() + shading(), atol=0.02)  # 5e-16
