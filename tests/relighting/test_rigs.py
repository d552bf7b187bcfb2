"""Random rigs in the free space of a scene."""

from __future__ import annotations

import pytest
import torch

from rgspipe.relighting.rigs import TINT, random_rig
from rgspipe.renderer.dictionary import LightDictionary

POSITIONS = torch.arange(15.0).reshape(5, 3)
IRRADIANCE = torch.rand(5, 40, generator=torch.Generator().manual_seed(1))
AREAS = torch.rand(40, generator=torch.Generator().manual_seed(2))
DICTIONARY = LightDictionary(POSITIONS, IRRADIANCE)


def test_lights_stand_on_different_candidates_and_are_equally_strong_but_for_their_colour() -> None:
    rig = random_rig(DICTIONARY, AREAS, 4, seed=3)
    places = [POSITIONS.tolist().index(light.position.tolist()) for light in rig]
    assert len(set(places)) == 4
    for place, light in zip(places, rig, strict=True):
        mean = (IRRADIANCE[place] * AREAS).sum() / AREAS.sum()
        colour = light.intensity * float(mean) * 4
        assert bool((colour >= 1.0 / TINT - 1e-5).all()) and bool((colour <= TINT + 1e-5).all())
        assert float(colour.max() / colour.min()) > 1.01


def test_the_seed_decides() -> None:
    first, again, other = (random_rig(DICTIONARY, AREAS, 3, seed) for seed in (0, 0, 1))
    assert all(torch.equal(a.position, b.position) for a, b in zip(first, again, strict=True))
    assert any(not torch.equal(a.intensity, b.intensity) for a, b in zip(first, other, strict=True))


@pytest.mark.parametrize("count", [0, 6])
def test_a_rig_that_the_dictionary_cannot_give_is_refused(count: int) -> None:
    with pytest.raises(ValueError, match="1 to 5"):
        random_rig(DICTIONARY, AREAS, count, seed=0)
