"""Slices through the loss have their minimum where the light is."""

from __future__ import annotations

import math

import pytest
import torch

from emitters import emitter_at
from lit_room import VISIBLE
from rgspipe.fitting import ImageCapture
from rgspipe.fitting.certainty.landscape import PLANES, best_intensity, loss_slices
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem


def _problem(room, light) -> LightProblem:
    return LightProblem.create(room.one.prepared, room.one.prepared.stack_images(room.images(light)))


def test_the_answer_is_the_least_of_every_plane(room, point_light):
    light = point_light(VISIBLE)
    slices = loss_slices(_problem(room, light), [Emitter.of(light)], reach=0.1, points=3)
    assert tuple(one.axes for one in slices) == PLANES
    for one in slices:
        assert one.loss.shape == (3, 3) and int(one.loss.argmin()) == 4
        assert float(one.loss[1, 1]) < 1e-9 < 1e-4 < float(one.loss[0, 1])  # measured 3e-15
        assert float(one.across[1]) == VISIBLE[one.axes[0]] and float(one.up[1]) == VISIBLE[one.axes[1]]
        assert float(one.across[2] - one.across[1]) == pytest.approx(0.1 * room.frozen.size)


def test_rows_run_along_the_second_axis(room, point_light):
    light = point_light(VISIBLE)
    problem = _problem(room, light)
    (plane, _, _) = loss_slices(problem, [Emitter.of(light)], reach=0.1, points=3)
    moved = emitter_at(torch.tensor([VISIBLE[0], float(plane.up[2]), VISIBLE[2]], dtype=torch.float64))
    columns = [problem.evaluate(moved)]
    intensity = problem.moments(columns, torch.ones_like(problem.target[:, :1])).intensity
    assert float(plane.loss[2, 1]) == pytest.approx(problem.unexplained(columns, intensity), rel=1e-5)


def test_other_lights_answer_with_their_intensity(room, point_light):
    """Two lights: where the moved one explains less, the other one's best intensity is taken."""
    one, other = point_light(VISIBLE), point_light((-0.2, 0.3, 0.2))
    image = [a + b for a, b in zip(room.images(one), room.images(other), strict=True)]
    problem = LightProblem.create(room.one.prepared, room.one.prepared.stack_images(image))
    slices = loss_slices(problem, [Emitter.of(other), Emitter.of(one)], light=1, reach=0.1, points=3)
    assert all(float(plane.loss[1, 1]) < 1e-9 for plane in slices)  # measured 3e-15


def test_outside_the_region_nothing_is_known(room, point_light):
    light = point_light(VISIBLE)
    slices = loss_slices(_problem(room, light), [Emitter.of(light)], reach=2.0, points=3)
    assert all(math.isnan(float(one.loss[0, 0])) and float(one.loss[1, 1]) < 1e-9 for one in slices)


def test_an_even_number_of_points_has_no_middle(room, point_light):
    with pytest.raises(ValueError, match="odd"):
        loss_slices(_problem(room, point_light(VISIBLE)), [], points=4)


def _clipped(room, light, capture_known: bool = True) -> LightProblem:
    """The image of a light, its brightest quarter of values clipped."""
    (image,) = room.images(light)
    white = float(image.reshape(-1).quantile(0.75))
    capture = ImageCapture(clip=white if capture_known else None)
    prepared = room.one.prepared
    return LightProblem.create(prepared, prepared.stack_images([image.clamp(max=white)]), capture=capture)


def test_clipped_values_do_not_move_the_least_of_the_loss(room, point_light):
    light = point_light(VISIBLE)
    known, unknown = (
        loss_slices(_clipped(room, light, said), [Emitter.of(light)], reach=0.1, points=3) for said in (True, False)
    )
    for one, other in zip(known, unknown, strict=True):
        assert int(one.loss.argmin()) == 4 and float(one.loss[1, 1]) < 1e-9  # measured 2e-14
        assert float(other.loss[1, 1]) > 1e-2


def test_intensities_beside_clipped_values_are_those_of_one_sided_squares(room, point_light):
    """At a place that the light is not at, against a search over the strength of one channel."""
    light = point_light(VISIBLE)
    problem = _clipped(room, light)
    moved = Emitter.of(point_light((-VISIBLE[0], -VISIBLE[1], VISIBLE[2])))
    columns = [problem.evaluate(moved)]
    found = best_intensity(problem, columns)
    # What is left out of the first solution matters here: some clipped values are darker in the image.
    free = problem.moments(columns, problem.unclipped(torch.ones_like(problem.target))).intensity
    assert float((found / free - 1.0).abs().max()) > 1e-2
    least = problem.unexplained(columns, found)
    for channel in range(3):
        for factor in (0.98, 0.995, 1.005, 1.02):
            other = found.clone()
            other[:, channel] *= factor
            assert problem.unexplained(columns, other) > least
