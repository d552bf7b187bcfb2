"""Which combinations of candidates differ, against the comparison of rigs one by one."""

from __future__ import annotations

import math

import pytest
import torch

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.search.apart import CandidatePlaces
from rgspipe.fitting.search.compare import rig_distance
from rgspipe.renderer.point_sets import fibonacci_directions
from rgspipe.scene import PointLight, SpotLight

CANDIDATES, SEPARATION, SPACING = 12, 0.3, 0.5


@pytest.mark.parametrize("lights", [1, 2, 3, 4])
@pytest.mark.parametrize("aimed", [False, True])
def test_the_first_that_differ_are_those_that_a_comparison_of_rigs_takes(lights, aimed):
    generator = torch.Generator().manual_seed(lights)
    positions = torch.rand(CANDIDATES, 3, generator=generator).double()
    axes = fibonacci_directions(CANDIDATES).double()
    places = CandidatePlaces(positions.numpy(), axes.numpy() if aimed else None, SPACING)
    drawn = torch.stack([torch.randperm(CANDIDATES, generator=generator)[:lights] for _ in range(60)])
    combinations = [tuple(one) for one in drawn.tolist()]

    if aimed:
        lamps = [SpotLight.shaped().at(place, axis) for place, axis in zip(positions, axes, strict=True)]
    else:
        lamps = [PointLight(place, 1.0) for place in positions]
    emitters = [Emitter.of(lamp) for lamp in lamps]

    def differ(one, other):
        first, second = ([emitters[index] for index in rig] for rig in (one, other))
        if rig_distance(first, second, 1.0) > SEPARATION:
            return True
        turns = (max(float(axes[a] @ axes[b]) for b in other) for a in one)
        return aimed and any(turn < math.cos(SPACING) for turn in turns)

    expected = []
    for combination in combinations:
        if all(differ(combination, other) for other in expected):
            expected.append(combination)
    assert places.first_apart(combinations, 100, SEPARATION) == expected
    assert places.first_apart(combinations, 3, SEPARATION) == expected[:3]
    assert 1 < len(expected) < 60


def test_nothing_to_choose_from_leaves_nothing():
    places = CandidatePlaces(torch.rand(3, 3).double().numpy(), None, 0.0)
    assert places.first_apart([], 4, SEPARATION) == []
