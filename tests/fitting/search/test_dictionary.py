"""Candidates stand in free space, and their coarse images are those of full renderings."""

from __future__ import annotations

import torch

from lit_room import BOX_CENTER, BOX_SIZE, HIDDEN
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.combinations import Scored, best_apart, candidate_costs
from rgspipe.fitting.search.dictionary import build_dictionary, candidate_grid
from rgspipe.renderer.direct import unit_irradiance


def test_candidates_are_in_free_space(room):
    inside = (room.dictionary.positions - torch.tensor(BOX_CENTER)).abs().amax(dim=1) < 0.5 * BOX_SIZE
    assert not bool(inside.any())
    grid = candidate_grid(room.frozen, 6, 0)
    free = (grid - torch.tensor(BOX_CENTER)).abs().amax(dim=1) > 0.5 * BOX_SIZE + 0.1
    free &= grid.abs().amax(dim=1) < 0.4
    kept = (grid[:, None] == room.dictionary.positions[None]).all(dim=2).any(dim=1)
    assert bool(kept[free].all())  # nothing is rejected that stands free


def test_seed_decides_the_candidates(room):
    assert torch.equal(candidate_grid(room.frozen, 5, 3), candidate_grid(room.frozen, 5, 3))
    assert not torch.equal(candidate_grid(room.frozen, 5, 3), candidate_grid(room.frozen, 5, 4))


def test_irradiance_belongs_to_the_positions(room):
    expected, _ = unit_irradiance(room.frozen.bvh, room.dictionary.positions[10:12])
    torch.testing.assert_close(room.dictionary.irradiance[10:12], expected)


def test_the_nearest_candidates_of_a_hidden_light_are_among_the_best(room, point_light):
    light = point_light(HIDDEN)
    problem = LightProblem.create(room.one.prepared, room.one.prepared.stack_images(room.images(light)))
    (coarse,) = room.one.coarse
    costs = candidate_costs(Scored.of(problem, coarse))
    chosen = best_apart(costs, coarse.positions, 4, 0.16)
    distance = (coarse.positions[chosen] - light.position).norm(dim=1)
    assert float(distance.min()) < 0.2
    assert bool((costs >= 0).all() and (costs <= 1 + 1e-9).all())


def test_best_candidates_are_apart():
    positions = torch.tensor([[0.0, 0, 0], [0.1, 0, 0], [1.0, 0, 0], [1.05, 0, 0]])
    costs = torch.tensor([0.1, 0.2, 0.4, 0.3])
    assert best_apart(costs, positions, 3, 0.16) == [0, 3]


def test_a_dictionary_may_be_coarse(room):
    assert len(build_dictionary(room.frozen, 2, seed=0)) > 0
