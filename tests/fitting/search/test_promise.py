"""What another kind of light promises in closed form is what it keeps when it is fitted."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import HIDDEN, VISIBLE
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.promise import beam_promised, extent_promised
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.scene import Light
from rgspipe.scene.lights import LedLight, PointLight, SphereLight

COLOUR = [1.0, 2.0, 0.5]


def fitted(room, truth: Light, noise: float = 0.0) -> tuple[Refiner, State]:
    """A point fitted to an image of `truth`, which shows a part `noise` of its mean as noise."""
    images = room.images(truth)
    generator = torch.Generator().manual_seed(0)
    images = [image + noise * image.mean() * torch.randn(image.shape, generator=generator) for image in images]
    problem = LightProblem.create(room.one.prepared, room.one.prepared.stack_images(images)).coarsest(room.one.blocks)
    refiner = Refiner.of(problem)
    start = refiner.start((Emitter.of(PointLight(truth.position, 1.0)),), PLAIN)
    return refiner, refiner.refined(start, PLAIN, 20)


def test_an_extent_that_is_there_promises_what_is_left(room) -> None:
    refiner, state = fitted(room, SphereLight(HIDDEN, COLOUR, 0.05))
    found = extent_promised(refiner, state, 0, SphereLight(state.emitters[0].position, 1.0, 0.05))
    # To first order all of it: measured 0.60, and 0.75 of the sphere's own change, as shadows' edges are not straight.
    assert 0.5 < found.gain <= 1.0 and float(found.best[0]) == pytest.approx(1.0, abs=0.3)


def test_noise_promises_no_extent_and_larger_ones_have_more_of_a_signal(room) -> None:
    refiner, state = fitted(room, PointLight(HIDDEN, COLOUR), noise=0.02)
    place = state.emitters[0].position
    small, large = (extent_promised(refiner, state, 0, SphereLight(place, 1.0, radius)) for radius in (0.02, 0.04))
    assert abs(large.gain) < 0.03
    # Measured 3.9: between the size itself, as a hard shadow's edge has it, and the fourth power, as a smooth one has.
    assert 2.0 < large.signal / small.signal < 16.0


@pytest.mark.parametrize("axis", [(0.0, 0.0, -1.0), (0.6, 0.0, 0.8)])
def test_a_beam_promises_where_it_points_and_a_point_promises_none(room, axis: tuple[float, ...]) -> None:
    led = LedLight(VISIBLE, COLOUR, axis, 1.0)
    refiner, state = fitted(room, PointLight(VISIBLE, COLOUR), noise=0.02)
    assert beam_promised(refiner, state, 0).gain < 0.05
    images = [replace(led, intensity=led.intensity), PointLight(VISIBLE, COLOUR)]
    # Mostly a point, and a little of an LED besides.
    mixed = [0.2 * one + other for one, other in zip(*(room.images(light) for light in images), strict=True)]
    problem = LightProblem.create(room.one.prepared, room.one.prepared.stack_images(mixed)).coarsest(room.one.blocks)
    refiner = Refiner.of(problem)
    state = refiner.start((Emitter.of(PointLight(VISIBLE, 1.0)),), PLAIN)
    found = beam_promised(refiner, state, 0)
    pointing = torch.nn.functional.normalize(found.best, dim=0)
    # Measured 0.10 at least.
    assert found.gain > 0.07 and float(pointing @ torch.tensor(axis).double()) > 0.7
