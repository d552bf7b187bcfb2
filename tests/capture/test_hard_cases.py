"""Captures that are no matt room with a lamp out of sight: what is said of them, instead of a number alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch

from photographed_room import LAMPS, painted_room, pictures, radiance_under
from rgspipe.capture.captured import Captured, capture_scene
from rgspipe.capture.options import CaptureOptions
from rgspipe.capture.words import captured_words
from rgspipe.datasets.views import View

OPTIONS = CaptureOptions(gather_rays=128, supersampling=2, grid=4, count=1, unseen=False)


def captured(views: list[View]) -> Captured:
    surfels = painted_room()
    return capture_scene(views, replace(surfels, albedo=torch.full_like(surfels.albedo, 0.5)), OPTIONS)


@cache
def plain() -> Captured:
    """Of ten photographs under a lamp that none shows."""
    return captured(pictures(radiance_under(LAMPS[:1])))


def near(place: tuple[float, float, float], reach: float) -> torch.Tensor:
    """(N,) bool: surfels around a place."""
    return (painted_room().centers - torch.tensor(place)).norm(dim=1) < reach


def test_a_plain_room_has_nothing_odd() -> None:
    found = plain()
    assert float((found.lamps[0].position - LAMPS[0].position).norm()) < 0.02
    assert found.answer.over_even > 0.6
    odd = found.oddities
    assert odd.impossible < 0.02 and odd.single < 0.1
    assert odd.glowing is None or odd.glowing.share < 0.02
    assert odd.shining is None or odd.shining.share < 0.03
    assert odd.open is None or odd.open.share < 0.02
    words = captured_words(found)
    assert "taken to be open" not in words
    assert "would have to reflect" not in words and "mirror" not in words and "of all: a lamp" not in words


@pytest.mark.slow
def test_light_that_is_the_same_everywhere_tells_of_no_lamp() -> None:
    # Measured 0.0, and 0.0 by ten photographs, whose minima are settled in twice the time.
    found = captured(pictures(0.4 * painted_room().albedo, 5))
    assert found.answer.over_even < 0.2
    assert "the photographs do not tell that there is one" in captured_words(found)


def test_a_lamp_in_the_picture_is_named_with_its_place() -> None:
    spot = (0.3, -0.3, -0.5)
    # Large enough that pictures measure some of its surfels, and that nobody takes for the lamp: at 10 it is.
    glow = torch.where(near(spot, 0.15)[:, None], 6.0, 0.0).expand(-1, 3)
    found = captured(pictures(radiance_under(LAMPS[:1], glow), 14, 64))
    odd = found.oddities.glowing
    assert odd is not None and float(np.linalg.norm(np.array(odd.place) - spot)) < 0.12  # measured 0.066
    assert "a lamp or a window in the picture" in captured_words(found)
    assert float((found.lamps[0].position - LAMPS[0].position).norm()) < 0.03, "its light is no lamp's"


def test_a_wall_that_is_missing_is_named_with_its_place() -> None:
    surfels = painted_room()
    kept = surfels.centers[:, 0] > -0.5 + 1e-6
    views = pictures(radiance_under(LAMPS[:1]))
    rest = replace(surfels, **{name: tensor[kept] for name, tensor in surfels.tensors().items()})
    found = capture_scene(views, replace(rest, albedo=torch.full_like(rest.albedo, 0.5)), OPTIONS)
    odd = found.oddities.open
    # Measured 0.16; the box's side at x = -0.1 faces little else.
    assert odd is not None and 0.1 < odd.share < 0.25 and odd.place[0] < 0.0
    assert "is taken to be open" in captured_words(found)


def test_a_mirror_is_named_with_its_place() -> None:
    spot, generator = (0.5, 0.1, 0.1), torch.Generator().manual_seed(0)
    sent = radiance_under(LAMPS[:1]).expand(10, -1, -1).clone()
    # It shows to each camera what is somewhere else.
    mirror = near(spot, 0.4)
    other = torch.randint(sent.shape[1], (10, int(mirror.sum())), generator=generator)
    sent[:, mirror] = 2.0 * torch.stack([view[chosen] for view, chosen in zip(sent, other, strict=True)])
    found = captured(pictures(sent))
    odd = found.oddities.shining
    assert odd is not None and float(np.linalg.norm(np.array(odd.place) - spot)) < 0.3
    assert "look different from different sides" in captured_words(found)
    assert float((found.lamps[0].position - LAMPS[0].position).norm()) < 0.03


def test_one_photograph_is_said_to_be_one_and_is_less_sure() -> None:
    found, all_of_them = captured(pictures(radiance_under(LAMPS[:1]), 1, 64)), plain()
    assert found.oddities.single == 1.0
    assert "in one photograph only" in captured_words(found)
    spread = [float(one.certainty.spread(one.frozen.size)[0]) for one in (found, all_of_them)]
    error = float((found.lamps[0].position - LAMPS[0].position).norm())
    # Measured: 0.0236 of one, 0.0160 of ten, and the lamp of the one is 0.0039 off.
    assert spread[0] > 1.2 * spread[1] and error < 2.0 * spread[0]


def test_black_walls_leave_the_scale_unknown() -> None:
    found = captured(pictures(radiance_under(LAMPS[:1], darker=0.05)))
    # Measured: a factor of e, of which 2 % of the light says something.
    assert found.certainty.scale > 0.5 and found.certainty.bounced < 0.05
    assert "Only the products of intensities and albedo are known" in captured_words(found)
