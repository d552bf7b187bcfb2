"""Points of one view in the depth of another: which agree, which contradict, which say nothing."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from raycast import ROOM, Cuboid, room_views, view_of
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_views import degraded
from rgspipe.degradation.options import ViewErrors
from rgspipe.evidence.readings import READINGS, Reading
from rgspipe.evidence.reprojection import POINTS, ROUNDING, Agreement, Trials

STATED = READINGS[0]


def _agreement(views: list[View], reading: Reading = STATED) -> Agreement:
    return Trials.draw(views, along_rays=False).agreement(reading)


def _facing_walls(distance: float, second: float) -> list[View]:
    """Two cameras side by side before a wall, the second of which measures it at `second`."""
    wall = [Cuboid((0.0, distance + 0.05, 0.0), (9.0, 0.1, 9.0))]
    views = [view_of(wall, (x, 0.0, 0.0), (x, 1.0, 0.0), 24, 1.0) for x in (0.0, 0.3)]
    return [views[0], replace(views[1], depth=torch.full_like(views[1].depth, second))]


@pytest.mark.parametrize(
    ("second", "first", "back"),
    [(1.0, "agreeing", "agreeing"), (2.0, "contradicting", "nothing"), (0.5, "nothing", "contradicting")],
)
def test_points_before_a_depth_contradict_and_those_behind_it_say_nothing(second: float, first: str, back: str) -> None:
    found = _agreement(_facing_walls(1.0, second))
    for view, kind in enumerate((first, back)):
        counts = {name: int(getattr(found, name)[view]) for name in ("agreeing", "contradicting")}
        other = [name for name in counts if name != kind]
        assert all(counts[name] == 0 for name in other)
        assert kind == "nothing" or counts[kind] > 0.3 * POINTS


def test_points_where_the_other_view_sees_no_surface_contradict() -> None:
    views = _facing_walls(1.0, torch.inf)
    views[1].depth[0, -1] = 1.0
    found = _agreement(views)
    assert found.agreeing.sum() == 0 and found.contradicting[0] > 0.3 * POINTS


def test_points_where_the_other_depth_is_not_known_say_nothing() -> None:
    views = _facing_walls(1.0, 1.0)
    views[1].depth[:, 6:] = torch.nan
    found = _agreement(views)
    assert 0 < found.agreeing[0] < found.agreeing[1] and found.contradicting.sum() == 0


def test_exact_depth_agrees_but_at_silhouettes() -> None:
    found = _agreement(room_views(12, 24))
    assert found.share > 0.97  # measured 0.983
    assert found.tested > 2000  # measured 5084


def test_cameras_in_one_place_have_nothing_to_say() -> None:
    views = [view_of([ROOM], (0.1, 0.0, 0.0), (x, 1.0, 0.2), 24, 1.4) for x in (-0.3, 0.0, 0.4)]
    assert _agreement(views).tested == 0
    assert _agreement(views, Reading(scale=1000.0)).tested == 0


def test_noise_widens_what_agrees() -> None:
    views = room_views(6, 24)
    assert Trials.draw(views, False).tolerance < 1.1 * ROUNDING
    noisy = Trials.draw(degraded(views, ViewErrors(depth_noise=0.02)), False)
    assert noisy.tolerance == pytest.approx(3 * 2**0.5 * 0.02, rel=0.3)  # measured 0.102
    assert noisy.agreement(STATED).share > 0.95  # measured 0.99
