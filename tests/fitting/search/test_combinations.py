"""Combinations of candidates: closed forms against brute force, and coarse images of spots against renderings."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy.optimize
import torch

from lit_room import HIDDEN, VISIBLE
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import AimedOptions
from rgspipe.fitting.search.aimed_candidates import aimed_candidates
from rgspipe.fitting.search.combinations import (
    Scored,
    best_apart,
    best_combinations,
    best_pairs,
    bright_gains,
    candidate_costs,
    extensions,
)
from rgspipe.renderer.point_sets import fibonacci_directions
from rgspipe.scene import SpotLight


def scored(candidates: int, seed: int = 0) -> Scored:
    """Random images of 20 blocks, and a target that three of the candidates make."""
    generator = torch.Generator().manual_seed(seed)
    images = torch.rand(candidates, 3, 20, generator=generator)
    target = images[3] + 0.5 * images[candidates // 2] + 0.7 * images[-1]
    square = images.square().sum(dim=2).double()
    product = torch.einsum("kcb,cb->kc", images, target).double()
    return Scored(images, target, square, product, float(target.double().square().sum()))


def explained(one: Scored, combination: tuple[int, ...]) -> float:
    """The share of energy that a combination explains, by an active-set solver."""
    left = 0.0
    for channel in range(3):
        matrix = one.images[list(combination), channel].double().numpy().T
        left += scipy.optimize.nnls(matrix, one.target[channel].double().numpy())[1] ** 2
    return 1.0 - left / one.energy


def test_the_best_pairs_are_those_of_brute_force() -> None:
    one = scored(12)
    found = best_pairs(one, 5)
    values = {pair: explained(one, pair) for pair in itertools.combinations(range(12), 2)}
    best = sorted(values.values(), reverse=True)[:5]
    np.testing.assert_allclose([values[pair] for pair in found], best, rtol=1e-5)


def test_extensions_state_what_they_explain() -> None:
    one = scored(12)
    ranked = extensions(one, one.images[[3]], count=11)
    for index, gain in ranked:
        assert gain == pytest.approx(explained(one, (3, index)), abs=1e-5)
    assert [gain for _, gain in ranked] == sorted((gain for _, gain in ranked), reverse=True)


def test_three_lights_are_found_among_the_candidates() -> None:
    one = scored(30, seed=1)
    (best, *_) = best_combinations(one, torch.rand(30, 3, generator=torch.Generator().manual_seed(0)), 3, 4)
    assert best == (3, 15, 29)


def test_directions_are_spread_evenly() -> None:
    directions = fibonacci_directions(AimedOptions().axes)
    cosine = directions @ directions.T - 2.0 * torch.eye(AimedOptions().axes)
    nearest = torch.rad2deg(torch.acos(cosine.amax(dim=1)))
    assert float(nearest.min()) > 15.0 and float(nearest.max()) < 30.0  # measured 22.6 to 24.2 degrees


def test_coarse_images_of_spots_are_like_renderings(room) -> None:
    """Shares at the mean place of a block stand for those of its surfels, so they agree but for the cones' rims."""
    shape = SpotLight.shaped("gaussian", math.radians(40.0), 0.2)
    coarse = aimed_candidates(room.one.prepared, room.dictionary, [shape])
    wide = math.hypot(shape.falloff, 0.15)
    half = shape.cone_angle + math.sqrt(2.0 * math.log(2.0)) * (shape.falloff - wide)
    errors = []
    for index in range(0, len(coarse), len(coarse) // 12):
        emitter = coarse.emitter(index)
        light = SpotLight.shaped("gaussian", half, wide).at(emitter.position, emitter.axis)
        image = room.frozen.render(room.views[0], (light,), sharp=False).reshape(-1, 3)[room.one.prepared.pixels]
        expected = coarse.blocks @ image
        errors.append(float((coarse.images[index] - expected).norm() / expected.norm()))
    # Measured: median 0.02, largest 0.08.
    assert float(np.median(errors)) < 0.1


def test_a_spot_candidate_near_the_truth_explains_most(room) -> None:
    shape = SpotLight.shaped("gaussian", math.radians(30.0), 0.2)
    place = torch.tensor(VISIBLE, dtype=torch.float64)
    axis = torch.nn.functional.normalize(torch.tensor(HIDDEN, dtype=torch.float64) - place, dim=0)
    light = shape.at(place, axis)
    prepared = room.two.prepared
    images = [room.frozen.render(view, (light,), sharp=False) for view in room.views]
    problem = LightProblem.create(prepared, prepared.stack_images(images))
    coarse = aimed_candidates(prepared, room.dictionary, [shape])
    ranked = best_combinations(Scored.of(problem, coarse), coarse.positions, 1, 12)
    distance = min(float((coarse.positions[k].double() - place).norm()) for (k,) in ranked)
    turn = max(float(coarse.axes[k].double() @ axis) for (k,) in ranked)
    assert distance < 0.25 and turn > math.cos(math.radians(25.0))


def test_a_narrow_pool_decides_by_plain_squares(room) -> None:
    """Of a narrow spot the candidate that explains the bright pool comes first by plain squares."""
    shape = SpotLight.shaped("gaussian", math.radians(10.0), 0.1)
    prepared = room.two.prepared
    coarse = aimed_candidates(prepared, room.dictionary, [shape])
    emitter = coarse.emitter(int(coarse.square.sum(dim=1).argmax()))
    light = shape.at(emitter.position, emitter.axis)
    images = [room.frozen.render(view, (light,), sharp=False) for view in room.views]
    problem = LightProblem.create(prepared, prepared.stack_images(images))
    gains = bright_gains(problem, coarse)
    (best,) = gains.topk(1).indices.tolist()
    assert float((coarse.positions[best].double() - emitter.position).norm()) < 0.25
    assert float(coarse.axes[best].double() @ emitter.axis) > math.cos(math.radians(25.0))
    # The rims of candidates are wider; measured 0.89.
    assert 0.8 < float(gains[best]) <= 1.0


def test_the_nearest_candidates_of_a_hidden_light_are_among_the_best(room, point_light):
    light = point_light(HIDDEN)
    problem = LightProblem.create(room.one.prepared, room.one.prepared.stack_images(room.images(light)))
    (coarse,) = room.one.coarse(AimedOptions())
    costs = candidate_costs(Scored.of(problem, coarse))
    chosen = best_apart(costs, coarse.positions, 4, 0.16)
    distance = (coarse.positions[chosen] - light.position).norm(dim=1)
    assert float(distance.min()) < 0.2
    assert bool((costs >= 0).all() and (costs <= 1 + 1e-9).all())


def test_best_candidates_are_apart():
    positions = torch.tensor([[0.0, 0, 0], [0.1, 0, 0], [1.0, 0, 0], [1.05, 0, 0]])
    costs = torch.tensor([0.1, 0.2, 0.4, 0.3])
    assert best_apart(costs, positions, 3, 0.16) == [0, 3]
