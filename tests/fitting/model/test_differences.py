"""The baseline with derivatives by central differences."""

from __future__ import annotations

import math

import pytest
import torch

from emitters import emitter_at
from lit_room import VISIBLE
from rgspipe.fitting import Search
from rgspipe.fitting.model.differences import by_differences, central_differences
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.scene.lights import SpotLight
from rgspipe.scene.lights.coordinates import tangents


def test_differences_are_those_of_an_analytic_function() -> None:
    """Of sin x + y² + z·axis·(0, 1, 0) and the cone, in natural units: measured 4e-7."""
    spot = emitter_at(
        torch.tensor([0.3, -0.2, 0.5], dtype=torch.float64),
        torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64),
        SpotLight.shaped("gaussian", 0.5, 0.2),
        shape_free=True,
    )

    def image(emitter: Emitter) -> torch.Tensor:
        x, y, z = emitter.position
        light = emitter.light
        value = x.sin() + y.square() + z * light.direction[1] + light.cone_angle**2 + 3.0 * light.falloff
        return value.reshape(1, 1).expand(1, 3)

    slopes = central_differences(image, spot, 2.0)[0, 0, 1:]
    by_axis = 0.5 * tangents(spot.axis)[:, 1]
    expected = torch.tensor([math.cos(0.3), -0.4, 0.0, float(by_axis[0]), float(by_axis[1]), 1.0, 3.0])
    torch.testing.assert_close(slopes, expected.double(), rtol=1e-5, atol=1e-5)


def test_both_methods_find_the_same_light_and_differences_render_more(room, point_light) -> None:
    light = point_light(VISIBLE)
    images = room.images(light, 2)
    ours, baseline = (room.two.fit(images, solver=Search(derivatives=kind)) for kind in ("analytic", "differences"))
    for result in (ours, baseline):
        assert float((result.lights[0].position - light.position).norm()) < 1e-3  # measured 1e-7 and 2e-6
    # Seven images an evaluation.
    assert baseline.evaluations > 4 * ours.evaluations


def test_derivatives_of_both_kinds_agree_in_smooth_pixels(room, point_light) -> None:
    prepared = room.one.prepared
    problem = LightProblem.create(prepared, prepared.stack_images(room.images(point_light(VISIBLE))))
    emitter = emitter_at(torch.tensor(VISIBLE, dtype=torch.float64) + 0.003)
    exact, differences = problem, by_differences(problem)
    ours, theirs = (one.evaluate(emitter) for one in (exact, differences))
    apart = (ours - theirs)[:, :, 1:].abs().median() / theirs[:, :, 1:].abs().median()
    assert float(apart) < 0.01 and problem.renderings([emitter]) == 1
    assert differences.renderings([emitter]) == 7
    assert float((ours - theirs)[:, :, 0].abs().max()) == pytest.approx(0.0)
