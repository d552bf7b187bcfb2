"""Surfaces that no camera saw: which surfels are of one, and how much a guess of their albedo is in doubt."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from rgspipe.scene import Surfels
from rgspipe.scene.guesses import (
    FLAT,
    LEAST_DOUBT,
    MOST,
    SIDES,
    GuessedSurfaces,
    doubts_of_guesses,
    guessed_surfaces,
    likely_variance,
    spread_of_albedo,
)
from rgspipe.scene.rectangles import solid_box, surfels_on
from rgspipe.scene.surfels import quaternion_from_normal
from rooms import closed_box, sphere
from rooms import surfels_on as surfels_on_points


@pytest.fixture
def box() -> Surfels:
    return closed_box(0.1)


def guessed_where(surfels: Surfels, chosen: torch.Tensor) -> Surfels:
    return replace(surfels, guessed=chosen.to(surfels.centers))


def test_what_was_seen_is_no_guess(box):
    assert guessed_surfaces(box).shape == (0, len(box))
    assert float(spread_of_albedo(box)) == LEAST_DOUBT  # all of one albedo


def test_walls_that_meet_are_surfaces_of_their_own_and_the_largest_comes_first(box):
    floor, wall = box.normals[:, 2] > 0.9, (box.normals[:, 0] > 0.9) & (box.centers[:, 2] > 0.0)
    marks = guessed_surfaces(guessed_where(box, floor | wall))
    assert torch.equal(marks.bool(), torch.stack([floor, wall]))


def test_two_patches_of_one_wall_are_two_surfaces(box):
    floor, x = box.normals[:, 2] > 0.9, box.centers[:, 0]
    marks = guessed_surfaces(guessed_where(box, floor & (x.abs() > 0.3)))
    assert len(marks) == 2 and torch.equal(marks.sum(dim=0) > 0, floor & (x.abs() > 0.3))


def test_many_small_surfaces_are_doubted_together(box):
    alone = torch.zeros(len(box), dtype=torch.bool)
    alone[:: len(box) // 20] = True  # three rows apart
    marks = guessed_surfaces(guessed_where(box, alone))
    assert len(marks) == MOST + 1 and torch.equal(marks.sum(dim=0), alone.to(marks))


def test_the_spread_is_that_of_what_cameras_saw(box):
    albedo = torch.where((box.centers[:, 0] > 0.0)[:, None], 0.2, 0.8).expand(-1, 3).double()
    seen = replace(box, albedo=albedo)
    half = 0.5 * math.log(4.0)
    assert float(spread_of_albedo(seen)) == pytest.approx(half, rel=0.01)  # measured 0.6931, as many on either side
    assert float(spread_of_albedo(guessed_where(seen, albedo[:, 0] > 0.5))) == LEAST_DOUBT


def test_a_surface_that_goes_on_in_the_plane_of_others_is_expected_to_be_like_these(box):
    floor, wall, x = box.normals[:, 2] > 0.9, box.normals[:, 0] > 0.9, box.centers[:, 0]
    albedo = torch.full_like(box.albedo, 0.2)
    albedo[floor] = torch.where((x[floor] < 0.0)[:, None], 0.5, 0.6).expand(-1, 3).to(albedo)
    beyond = guessed_where(replace(box, albedo=albedo), floor & (x > 0.2) | wall)
    expected, doubt = GuessedSurfaces.of(beyond).expected(albedo)
    known = expected.isfinite().all(dim=1)
    # Nothing of the wall was seen, so nothing is expected of it.
    assert torch.equal(known, floor & (x > 0.2))
    assert bool((expected[known] == 0.5).all())
    seen = albedo[floor & (x <= 0.2)].mean(dim=1).log()
    torch.testing.assert_close(doubt[known], seen.std(correction=0).expand(int(known.sum()), 1).to(doubt))
    doubts = doubts_of_guesses(beyond)
    assert torch.equal(doubts[known], doubt[known, 0]) and not bool(doubts[beyond.guessed == 0.0].any())
    assert torch.equal(doubts[wall], spread_of_albedo(beyond).expand(int(wall.sum())))


def test_a_strip_of_a_wall_tells_nothing_of_a_wall_twenty_times_as_large():
    box = closed_box(0.05)
    floor, x = box.normals[:, 2] > 0.9, box.centers[:, 0]
    low = float(x[floor].min())
    hidden = guessed_where(box, floor & (x > low + 1e-6))
    expected, _ = GuessedSurfaces.of(hidden).expected(box.albedo)
    assert not bool(expected.isfinite().any())


def solid(colours: list[list[float]]) -> Surfels:
    """A box in the open of 1 × 1 × 1, its six faces in these colours, whose face y = 1 is guessed."""
    made = surfels_on(solid_box([0.5, 0.5, 0.5], [1.0, 1.0, 1.0], [0.5, 0.5, 0.5]), 600)
    faces = torch.eye(3, dtype=torch.float64)
    albedo = made.albedo.clone()
    for face, colour in enumerate(colours):
        along = made.normals.double() @ faces[face // 2] * (1.0 if face % 2 else -1.0)
        albedo[along > 0.9] = torch.tensor(colour).to(albedo)
    back = made.normals[:, 1] > 0.9
    albedo[back] = 0.1
    return guessed_where(replace(made, albedo=albedo), back)


def test_another_side_of_a_thing_is_expected_to_be_like_those_that_were_seen() -> None:
    things = solid([[0.6, 0.4, 0.3]] * 6)
    back = things.guessed > 0.0
    found, doubt = GuessedSurfaces.of(things).expected(things.albedo)
    torch.testing.assert_close(found[back], torch.tensor([0.6, 0.4, 0.3]).to(found).expand(int(back.sum()), 3))
    assert float(doubt[back].max()) == pytest.approx(LEAST_DOUBT)  # all sides are alike
    assert bool(found[~back].isnan().all())


def test_it_is_doubted_as_much_as_the_sides_differ_that_it_touches() -> None:
    """Sides x = 0 and x = 1 are half as bright as the others: 40 of the 80 surfels around it are 0.3 off the rest."""
    things = solid([[0.3] * 3] * 2 + [[0.6] * 3] * 4)
    back, step = things.guessed > 0.0, 0.3**2
    doubt = GuessedSurfaces.of(things).expected(things.albedo)[1][back]
    # Of eight edges between sides that were seen six have one of these on one side. For Student's t of four degrees
    # 4 s² + d² = ¾ · 5 d² of these, and (80 + 4) s² = 4 common + 40 · 5 d² / (4 + d²/s²) of what it touches.
    common, variance = 0.6875 * step, (0.3 * float(doubt.max())) ** 2
    known = 4.0 * common + 40.0 * 5.0 * step / (4.0 + step / variance)
    assert float(doubt.min()) == float(doubt.max())
    assert 84.0 * variance == pytest.approx(known, rel=1e-5)  # measured 4e-15
    # A fit doubts it as much as anything that was not seen.
    doubts = doubts_of_guesses(things)
    assert torch.equal(doubts[back], spread_of_albedo(things).expand(int(back.sum())).to(doubts))


def test_a_few_things_that_are_black_beside_white_do_not_open_what_all_others_are_like() -> None:
    """Nine in ten differ by what draws of a deviation of 0.03 do, the others by 0.7."""
    draws = 0.03 * torch.randn(900, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    mixed = torch.cat([draws, torch.full((100,), 0.7).double()])
    # Student's t has draws of a Gaussian narrower than their deviation. Measured 0.0249 of these alone, 0.0381 of all.
    assert float(likely_variance(draws).sqrt()) == pytest.approx(0.025, rel=0.02)
    assert float(likely_variance(mixed).sqrt()) < 0.045 < 0.2 < float(mixed.square().mean().sqrt())


def test_what_is_seen_little_of_is_as_what_all_have_in_common() -> None:
    common = torch.tensor(0.01, dtype=torch.float64)
    assert float(likely_variance(common.new_zeros(0), common)) == pytest.approx(0.01)
    assert float(likely_variance(common.new_zeros(1), common)) == pytest.approx(0.008)  # four fifths of it
    assert float(likely_variance(common.new_zeros(996), common)) == pytest.approx(4e-5)
    assert float(likely_variance(common.new_zeros(0))) == 0.0


def balls(apart: float, colours: tuple[float, float]) -> Surfels:
    """Two balls of radius 1, `apart` along x, of these greys, less what is inside of the other; y > 0 is guessed."""
    one = sphere(1200)
    parts = []
    for middle, colour in zip((-0.5 * apart, 0.5 * apart), colours, strict=True):
        centers = one.centers + torch.tensor([middle, 0.0, 0.0], dtype=torch.float64)
        outside = (centers + torch.tensor([middle, 0.0, 0.0], dtype=torch.float64)).norm(dim=1) > 1.0
        albedo = torch.full((int(outside.sum()), 3), colour, dtype=torch.float64)
        parts.append((centers[outside], -one.normals[outside], albedo))
    centers, normals, albedo = (torch.cat(part) for part in zip(*parts, strict=True))
    made = surfels_on_points(centers, normals, 0.1, albedo)
    return guessed_where(replace(made, albedo=torch.where(centers[:, 1:2] > 0.0, 0.1, albedo)), centers[:, 1] > 0.0)


@pytest.mark.parametrize("apart", [4.0, 1.9, 1.2])
def test_what_of_a_bent_surface_is_out_of_sight_is_expected_to_be_like_the_rest(apart: float) -> None:
    """Two balls beside each other, or sunk into each other: each has a side of its own that was seen."""
    things = balls(apart, (0.3, 0.6))
    found, doubt = GuessedSurfaces.of(things).expected(things.albedo)
    back, x = things.guessed > 0.0, things.centers[:, 0]
    assert bool(found[~back].isnan().all())
    torch.testing.assert_close(found[back], torch.where(x < 0.0, 0.3, 0.6)[back, None].expand(-1, 3).to(found))
    assert float(doubt[back].max()) == pytest.approx(LEAST_DOUBT, rel=1e-6)  # each is of one colour
    # A fit doubts it as much as anything that was not seen.
    assert torch.equal(doubts_of_guesses(things)[back], spread_of_albedo(things).expand(int(back.sum())))


def test_two_things_that_nothing_parts_are_in_doubt_by_both_their_colours() -> None:
    """Balls that are turned by 29° where they meet are one surface: it is of two greys, as many surfels of either."""
    things = balls(0.5, (0.3, 0.6))
    found, doubt = (part[things.guessed > 0.0] for part in GuessedSurfaces.of(things).expected(things.albedo))
    # A half is 0.3 off the other: 4 s² + d² = ½ · 5 d² for Student's t of four degrees.
    known = 0.3 * math.sqrt(0.375) / float(found[0, 0])
    assert float(doubt.min()) == float(doubt.max()) == pytest.approx(known, rel=0.01)  # measured 0.0011


def test_a_bent_surface_that_goes_on_from_nothing_is_like_the_sides_that_it_touches() -> None:
    """A face that is an arc of 100° into the box: no seen side goes on in it smoothly."""
    things = solid([[0.6, 0.4, 0.3]] * 6)
    back, radius = things.guessed > 0.0, 0.5 / math.sin(math.radians(50.0))
    across = (0.5 - things.centers[:, 0]) / radius
    arc = torch.stack([across, (1.0 - across.square()).clamp(min=0.0).sqrt(), torch.zeros_like(across)], dim=1)
    dent = radius * (arc[:, 1] - math.cos(math.radians(50.0)))
    moved = things.centers - torch.where(back, dent, 0.0)[:, None] * torch.tensor([0.0, 1.0, 0.0]).to(dent)
    turned = quaternion_from_normal(torch.where(back[:, None], arc, things.normals))
    things = replace(things, centers=moved, rotations=turned)
    assert float(things.normals[back].mean(dim=0).norm()) < FLAT
    surfaces = GuessedSurfaces.of(things)
    found, _ = surfaces.expected(things.albedo)
    assert surfaces.kinship == (SIDES,) and bool((surfaces.labels[back] == 0).all())
    torch.testing.assert_close(found[back], torch.tensor([0.6, 0.4, 0.3]).to(found).expand(int(back.sum()), 3))


def test_bent_surfaces_are_doubted_by_how_uneven_they_are_themselves() -> None:
    """Of two balls a quarter of one is of another grey: its far side is in doubt, that of the other is not."""
    things = balls(4.0, (0.3, 0.3))
    x = things.centers[:, 0]
    patched = (x > 0.0) & (things.centers[:, 2] > 0.0) & (things.guessed == 0.0)
    things = replace(things, albedo=torch.where(patched[:, None], 0.6, things.albedo))
    doubt = GuessedSurfaces.of(things).expected(things.albedo)[1][:, 0]
    back = things.guessed > 0.0
    even, uneven = float(doubt[back & (x < 0.0)].max()), float(doubt[back & (x > 0.0)].max())
    # As of one surface above, whose other half is common to both balls and counts for FREEDOM of 605 surfels.
    assert uneven == pytest.approx(math.sqrt(0.375), rel=0.02)  # measured 0.006
    assert even == pytest.approx(LEAST_DOUBT, rel=1e-6)


def test_walls_that_meet_in_a_corner_tell_nothing_of_each_other(box) -> None:
    wall = box.normals[:, 0] > 0.9
    found, _ = GuessedSurfaces.of(guessed_where(box, wall)).expected(box.albedo)
    assert bool(found.isnan().all())
