"""How much of a light reaches a scene tells places behind surfaces from those in the open."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from box_above_floor import box_above_floor
from lit_room import frozen_room
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.reach import LEAST_FLUX, Reach

#: Above the floor, beside the box, far above; and below the floor, below its edge, inside of the box.
OPEN = torch.tensor([[0.3, 0.2, 0.9], [-0.7, 0.0, 0.1], [2.0, -3.0, 4.0]], dtype=torch.float64)
SHUT = torch.tensor([[0.0, 0.3, -0.4], [1.02, 0.0, -0.05], [0.0, 0.0, 0.3]], dtype=torch.float64)


@pytest.fixture(scope="module")
def heap() -> FrozenScene:
    return box_above_floor()


def shares(frozen: FrozenScene, positions: torch.Tensor) -> torch.Tensor:
    reach = frozen.dictionary.reach(frozen.areas, frozen.surroundings)
    return reach.shares(positions, frozen.unit_irradiance(positions)[0] @ frozen.areas)


def test_next_to_nothing_reaches_a_scene_from_behind_its_surfaces(heap: FrozenScene) -> None:
    assert heap.surroundings.open
    assert float(shares(heap, OPEN).min()) > 10.0 * LEAST_FLUX  # measured 0.62
    assert float(shares(heap, SHUT).max()) < 0.1 * LEAST_FLUX  # measured 0


def test_no_candidate_stands_behind_surfaces(heap: FrozenScene) -> None:
    positions = heap.dictionary.positions
    below = (positions[:, 2] < 0.0) & (positions[:, :2].abs() < 1.0).all(dim=1)
    assert not bool(below.any())
    outside = (positions < heap.surroundings.lower) | (positions > heap.surroundings.upper)
    outside = outside.any(dim=1)
    for places in (positions[outside], positions[~outside]):
        assert float(shares(heap, places).max()) == pytest.approx(1.0)


def test_a_light_twice_as_far_away_reaches_as_much_of_what_it_could(heap: FrozenScene) -> None:
    way = torch.tensor([[0.6, 0.0, 0.8]], dtype=torch.float64)
    near, far = (float(shares(heap, distance * way)) for distance in (4.0, 8.0))
    assert far == pytest.approx(near, rel=0.1)  # measured 0.64 and 0.68


def test_in_a_closed_room_a_light_outside_reaches_nothing_and_without_light_nothing_does() -> None:
    room = frozen_room().with_dictionary(4)
    outside = torch.tensor([[0.0, 0.0, 0.75]], dtype=torch.float64)
    assert float(shares(room, outside)) < 0.1 * LEAST_FLUX  # measured 0
    dark = Reach.of(room.surroundings, outside, torch.zeros(1))
    assert dark.shares(outside, torch.zeros(1)).tolist() == [0.0]
    assert replace(dark, inside=2.0).shares(torch.zeros(1, 3), torch.ones(1)).tolist() == [0.5]
