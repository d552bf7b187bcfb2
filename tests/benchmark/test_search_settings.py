"""Each number that steers a search is halved and doubled, and what that does is told."""

from __future__ import annotations

import pytest
import torch

from lit_room import VISIBLE, frozen_room, room_cameras
from rgspipe.benchmark.search_settings import (
    NOISE,
    KnownTarget,
    numbers,
    rendered_spots,
    search_markdown,
    search_table,
    varied,
)
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews, LightSpec, Search
from rgspipe.fitting.options import AdamOptions, SearchOptions, TrackOptions
from rgspipe.scene import PointLight


def test_every_number_is_halved_and_doubled_alone() -> None:
    usual, found = Search(), {}
    for name, value, options in varied(usual):
        found.setdefault(name, []).append(value)
        assert options != usual and type(options) is Search
    assert found["starts"] == ["2", "8"] and found["bar.least"] == ["0.1", "0.4"]
    assert found["schedule.softness"] == ["(0.15, 0.075, 0.025)", "(0.6, 0.3, 0.1)"]
    # What is out of range is not tried.
    assert found["certainty.largest_share"] == ["0.495"]


def test_numbers_are_chosen_by_name_or_by_section() -> None:
    wide = Search(starts=6)
    found = [(name, value) for name, value, _ in varied(wide, ["starts", "limits"])]
    moves = [("limits.move", "0.06"), ("limits.move", "0.24"), ("limits.turn", "0.15"), ("limits.turn", "0.6")]
    assert found == [("starts", "3"), ("starts", "12"), *moves]
    assert all(options.starts == 6 for name, _, options in varied(wide, ["limits"]))
    assert list(varied(wide, [])) == []
    with pytest.raises(InputError, match=r"bar\.leest: .*Did you mean bar\.least"):
        list(varied(wide, ["bar.leest"]))


def test_few_numbers_steer_fits() -> None:
    """There were 103; whoever adds one takes another away, or says why fits need more."""
    assert sum(len(list(numbers(options))) for options in (SearchOptions, TrackOptions, AdamOptions)) <= 51


def test_the_table_has_a_row_for_each_and_the_usual_first() -> None:
    frozen = frozen_room().with_dictionary(4)
    views = FitViews.prepare(frozen, room_cameras(24)[:1], sharp=False)
    light = PointLight(torch.tensor(VISIBLE, dtype=torch.float64), 1.0)
    targets = [KnownTarget(views.render(light), (light,), views)]
    table = search_table(targets, frozen.size, names=["starts"])
    assert list(table["setting"]) == ["as it is", "starts", "starts"] and list(table["solved"]) == [1, 1, 1]
    assert float(table["error"].max()) < 0.01 and int(table["silent"].sum()) == 0  # measured 1e-5 %
    assert search_markdown(table).count("\n") == 5


def test_spots_are_what_the_scene_shows_with_noise() -> None:
    frozen = frozen_room()
    views = FitViews.prepare(frozen, room_cameras(24)[:2], lights=LightSpec("spot"), sharp=False)
    places = [PointLight(VISIBLE, (1.0, 2.0, 0.5)), PointLight((0.1, 0.2, 0.3), 1.0)]
    first, second = rendered_spots(views, places)
    for known, place in ((first, places[0]), (second, places[1])):
        torch.testing.assert_close(known.truth[0].position, place.position.double())
        seen = torch.stack(views.render(known.truth))
        noise = torch.stack(list(known.images)) - seen
        # 3456 numbers: the deviation of a sample is off by 1.2 %, one in a thousand by 4 %.
        assert abs(float(noise.std() / (NOISE * seen.mean())) - 1.0) < 0.06
    assert not torch.equal(first.truth[0].direction, second.truth[0].direction)
    again, _ = rendered_spots(views, places)
    assert all(torch.equal(one, other) for one, other in zip(first.images, again.images, strict=True))
