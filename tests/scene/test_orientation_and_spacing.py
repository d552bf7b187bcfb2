"""Fronts and spacing of scenes that bring neither."""

from __future__ import annotations

import pytest
import torch

import rgspipe.scene.spacing as spacing_module
from clouds import cloud
from rgspipe.scene.orientation import backs_towards, turned_over
from rgspipe.scene.spacing import inferred_coverage, surfel_spacing
from rooms import closed_box, sphere, surfels_on

EVERY = torch.ones(40, dtype=torch.bool)


def test_turning_over_changes_the_front_and_nothing_else() -> None:
    surfels = cloud(40, 0)
    other = turned_over(surfels, EVERY)
    torch.testing.assert_close(other.normals, -surfels.normals)
    torch.testing.assert_close(other.frames[:, 0], surfels.frames[:, 0])
    # The direction in which an edge lies, in the world.
    for one in (0, 1):
        towards = [
            torch.cos(s.clip_angles[:, one, None]) * s.frames[:, 0]
            + torch.sin(s.clip_angles[:, one, None]) * s.frames[:, 1]
            for s in (surfels, other)
        ]
        torch.testing.assert_close(*towards)
    torch.testing.assert_close(turned_over(other, EVERY).frames, surfels.frames)
    assert turned_over(surfels, ~EVERY).rotations.equal(surfels.rotations)


def test_the_inside_of_a_ball_looks_to_its_middle_and_not_to_a_far_point() -> None:
    ball = sphere(300)
    assert not backs_towards(ball, torch.zeros(1, 3)).any()
    assert bool(backs_towards(turned_over(ball, torch.ones(300, dtype=torch.bool)), torch.zeros(1, 3)).all())
    # A point of light far to the right sees the inside of the left half only; +x are its normals' signs.
    assert torch.equal(backs_towards(ball, torch.tensor([[1e6, 0.0, 0.0]])), ball.normals[:, 0] < 0)


def test_the_nearer_viewpoint_counts_more() -> None:
    one = surfels_on(torch.zeros(1, 3), torch.tensor([[0.0, 0.0, 1.0]]), 0.1)
    above, below = [0.0, 0.0, 1.0], [0.0, 0.0, -3.0]
    assert not backs_towards(one, torch.tensor([above, below])).any()
    assert bool(backs_towards(one, torch.tensor([above, *[below] * 10])).all())


@pytest.mark.parametrize("spacing", [0.05, 0.1])
def test_spacing_is_that_of_the_grid_whichever_way_normals_point(spacing: float) -> None:
    room = closed_box(spacing)
    signs = torch.where(torch.arange(len(room)) % 2 == 0, 1.0, -1.0)[:, None]
    assert surfel_spacing(room.centers, signs * room.normals) == pytest.approx(spacing, rel=1e-6)


def test_spacing_of_many_surfels_is_that_of_an_even_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = sphere(3000)
    all_of_them = surfel_spacing(ball.centers, ball.normals)
    monkeypatch.setattr(spacing_module, "SAMPLED", 300)
    # A spiral's spacing hardly varies: measured 9e-5.
    assert surfel_spacing(ball.centers, ball.normals) == pytest.approx(all_of_them, rel=1e-3)


def test_coverage_of_a_made_scene_is_found_again() -> None:
    room = closed_box(0.1)
    found = inferred_coverage(room.centers, room.normals, room.scales, low=0.5, high=0.9, layer=1.0, minimum_alpha=0.01)
    made = room.coverage
    assert found.layer_thickness == pytest.approx(made.layer_thickness, rel=1e-9)
    assert found.clip_softness == pytest.approx(made.clip_softness, rel=1e-6)
    assert (found.low, found.high) == (made.low, made.high)


def test_points_without_a_surface_are_refused() -> None:
    up = torch.tensor([[0.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="two surfels"):
        surfel_spacing(torch.zeros(1, 3), up)
    with pytest.raises(ValueError, match="one surface"):
        surfel_spacing(torch.zeros(3, 3), up.expand(3, 3))
