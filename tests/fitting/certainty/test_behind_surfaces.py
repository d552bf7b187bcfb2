"""Lights behind surfaces are told."""

from __future__ import annotations

import pytest

from box_above_floor import box_above_floor
from rgspipe.fitting.certainty.behind_surfaces import behind_surfaces
from rgspipe.fitting.findings import BehindSurfaces, FitStatus, gravest
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.scene.lights import PanelLight, SunLight


@pytest.fixture(scope="module")
def heap() -> FrozenScene:
    return box_above_floor()


def test_a_light_below_the_floor_or_in_the_box_is_said_to_be_there(heap: FrozenScene) -> None:
    above, below, inside = (PointLight(place, 1.0) for place in ([0.5, 0.3, 0.8], [1.02, 0.0, -0.05], [0.0, 0.0, 0.3]))
    found = behind_surfaces((above, below, inside), heap)
    assert [(one.number, one.count) for one in found] == [(2, 3), (3, 3)]
    assert all(one.share < 0.01 for one in found) and gravest(found) is FitStatus.UNDETERMINED
    assert behind_surfaces((above,), heap) == [] == behind_surfaces((), heap)


def test_lights_without_such_a_place_or_without_shadows_are_left(heap: FrozenScene) -> None:
    below = [0.2, 0.3, -0.3]
    assert behind_surfaces((PointLight(below, 1.0),), heap, shadows=False) == []
    assert (
        behind_surfaces(
            (PanelLight(below, 1.0, [0.0, 0.0, 1.0], 0.2, 0.1), SunLight(below, 1.0, [0.0, 0.0, 1.0])), heap
        )
        == []
    )
    assert isinstance(behind_surfaces((PointLight(below, 1.0),), heap)[0], BehindSurfaces)
