"""Candidates stand in free space, and belong to the scene."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from lit_room import BOX_CENTER, BOX_SIZE, frozen_room
from rgspipe.renderer.dictionary import candidate_grid
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.frozen import FrozenScene


@pytest.fixture(scope="module")
def frozen() -> FrozenScene:
    return frozen_room().with_dictionary(6)


def grid(frozen: FrozenScene, count: int, seed: int) -> Tensor:
    return candidate_grid(frozen.surroundings.lower, frozen.surroundings.upper, count, seed)


def test_candidates_are_in_free_space(frozen: FrozenScene) -> None:
    positions = frozen.dictionary.positions
    inside = (positions - torch.tensor(BOX_CENTER)).abs().amax(dim=1) < 0.5 * BOX_SIZE
    assert not bool(inside.any())
    points = grid(frozen, 6, 0)
    free = (points - torch.tensor(BOX_CENTER)).abs().amax(dim=1) > 0.5 * BOX_SIZE + 0.1
    free &= points.abs().amax(dim=1) < 0.4
    kept = (points[:, None] == positions[None]).all(dim=2).any(dim=1)
    assert bool(kept[free].all())  # nothing is rejected that stands free


def test_seed_decides_the_candidates(frozen: FrozenScene) -> None:
    assert torch.equal(grid(frozen, 5, 3), grid(frozen, 5, 3))
    assert not torch.equal(grid(frozen, 5, 3), grid(frozen, 5, 4))


def test_irradiance_belongs_to_the_positions(frozen: FrozenScene) -> None:
    expected, _ = unit_irradiance(frozen.bvh, frozen.dictionary.positions[10:12])
    torch.testing.assert_close(frozen.dictionary.irradiance[10:12], expected)


def test_a_dictionary_may_be_coarse_and_is_made_once(frozen: FrozenScene) -> None:
    coarse = frozen.with_dictionary(2)
    assert len(coarse.dictionary) > 0
    assert coarse.dictionary is coarse.dictionary
    assert coarse.with_solver("patches").dictionary is coarse.dictionary
