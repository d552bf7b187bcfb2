"""Bounds on what each effect can change hold, and effects are left out only within the tolerance."""

from __future__ import annotations

from dataclasses import asdict, replace
from math import pi

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.benchmark.effect_scenes import EFFECT_SCENES, ball
from rgspipe.benchmark.rooms import ROOMS
from rgspipe.renderer.effect_bounds import (
    NO_BOUND,
    EffectBounds,
    bounces_needed,
    measure_costs,
    measure_effects,
    void_share,
)
from rgspipe.renderer.effect_choice import EFFECTS, RigKind, choose_effects, cone_bound, rig_bounds
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.shadow_bound import ShadowBound, sample_lights, shadow_losses
from rgspipe.scene import Camera, PointLight, look_at
from rgspipe.scene.lights import SpotLight, SunLight
from rgspipe.scene.rectangles import surfels_on
from rgspipe.scene.surfels import NO_CLIP
from rooms import closed_box

NONE = ShadowBound(0.0, 0.0, proved=True, lights=0, uniform=0)
DARK = EffectBounds(interreflection=0.0, row_sum=0.0, shadows=NONE, specular=0.0)
ONE_POINT = RigKind(points=1)


def frozen(surfels) -> FrozenScene:
    return FrozenScene.freeze(surfels, gather_rays=32, patches=40, seed=0)


def test_the_bound_on_interreflection_is_attained() -> None:
    """No direct radiance of at most 1 sends more light around than that of 1 everywhere."""
    scene = frozen(closed_box(1 / 8, 0.5))
    bounds = measure_effects(scene, seed=0)
    # A closed room of albedo ρ: ρ/(1 − ρ) = 1. Measured 1.0000.
    assert bounds.interreflection == pytest.approx(1.0, rel=1e-3)
    assert bounds.row_sum == pytest.approx(0.5, rel=1e-3)
    direct = torch.rand(len(scene.surfels), 3, 8, generator=torch.Generator().manual_seed(0))
    assert float(scene.indirect(direct).amax()) <= bounds.interreflection


@pytest.mark.parametrize("tolerance", [0.1, 1e-2, 1e-3])
def test_after_the_bounces_needed_the_rest_is_within_the_tolerance(tolerance: float) -> None:
    scene = frozen(surfels_on(ROOMS["cornell"]().surfaces, 500))
    bounces = bounces_needed(measure_effects(scene, seed=0).row_sum, tolerance)
    direct = torch.rand(len(scene.surfels), 3, 4, generator=torch.Generator().manual_seed(0))
    rest = scene.indirect(direct) - scene.with_solver("patches", bounces=bounces).indirect(direct)
    assert float(rest.amax()) <= tolerance * float(direct.amax())


def test_bounces_needed_at_the_ends_of_the_range() -> None:
    assert bounces_needed(0.0, 1e-3) == 0
    assert bounces_needed(1e-4, 1e-3) == 0
    assert bounces_needed(0.5, 1e-3) == 10  # 0.5^11/0.5 = 0.00098
    assert bounces_needed(1.0, 1e-3) is None and bounces_needed(0.5, 0.0) is None


def test_lights_lose_no_more_to_shadow_than_the_bound_says() -> None:
    """A coarse ball, too coarse for the proof, and a valley so shallow that only grazing light is shaded."""
    for scene in (frozen(ball(700, 0.5)), frozen(EFFECT_SCENES["shallow valley"].build(500))):
        bounds = measure_effects(scene, seed=0).shadows
        assert not bounds.proved and bounds.lights > 0
        positions = sample_lights(scene, 64, torch.Generator().manual_seed(7))
        point, spot = shadow_losses(scene, positions)
        limit = min(bounds.point, 0.5)
        # Measured: none of 64 held-out lights above the bound; for the ball both are below 1e-6.
        assert float((point.clamp(max=0.5) > limit + 1e-6).float().mean()) <= 3 / 64
        assert bool((spot >= point - 1e-6).all())


def test_grazing_shadows_are_found_where_random_lights_show_none() -> None:
    """On a convex box only light almost along a face is lost, at the soft edges of the next face."""
    scene = frozen(EFFECT_SCENES["box in space"].build(600))
    random = shadow_losses(scene, sample_lights(scene, 16, torch.Generator().manual_seed(0)))[0]
    assert measure_effects(scene, seed=0).shadows.point > 1.5 * float(random.amax())


@pytest.mark.parametrize(("scale", "offset"), [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e3)])
def test_bounds_do_not_depend_on_size_or_place(scale: float, offset: float) -> None:
    one = EFFECT_SCENES["box in space"].build(300)
    coverage = replace(
        one.coverage,
        layer_thickness=scale * one.coverage.layer_thickness,
        clip_softness=scale * one.coverage.clip_softness,
    )
    clips = torch.where(one.clip_offsets < NO_CLIP, scale * one.clip_offsets, one.clip_offsets * max(1.0, scale))
    moved = replace(
        one, centers=scale * one.centers + offset, scales=scale * one.scales, clip_offsets=clips, coverage=coverage
    )
    here, there = (measure_effects(frozen(surfels), seed=0) for surfels in (one, moved))
    assert there.interreflection == here.interreflection == 0.0
    # Measured within 0.1 %: lights are drawn at the same places up to rounding, and the search climbs from there.
    assert there.shadows.point == pytest.approx(here.shadows.point, rel=0.02)


def test_each_light_adds_its_shadow_and_a_spot_may_be_aimed_at_the_worst() -> None:
    shadows = ShadowBound(point=1e-5, spot=0.5, proved=False, lights=100, uniform=80, sun=1e-3)
    bounds = replace(DARK, interreflection=1.0, shadows=shadows)
    sun = RigKind.of((SunLight.shaped(),))
    assert sun == RigKind(0, (), 1) and rig_bounds(bounds, sun)["shadows"] == pytest.approx(1e-3 * 4)
    assert rig_bounds(bounds, sun)["spot cones"] == 0.0
    # Twice for the sample, twice for the light that bounces on.
    assert rig_bounds(bounds, RigKind(3))["shadows"] == pytest.approx(3 * 1e-5 * 4)
    assert rig_bounds(bounds, RigKind(1, (0.0,)))["shadows"] == pytest.approx(2.0, rel=1e-3)


def test_the_choice_is_taken_again_for_another_kind_of_rig() -> None:
    """One point light loses nothing that matters, many do, and so does one spot."""
    shadows = ShadowBound(point=1e-4, spot=0.3, proved=False, lights=100, uniform=80)
    bounds = replace(DARK, shadows=shadows)
    cone, light = SpotLight.shaped("gaussian", 0.4, 0.1), PointLight(torch.zeros(3), torch.ones(3))
    decided = {
        kind: choose_effects(bounds, 1e-3, kind)
        for kind in (RigKind.of((light,)), RigKind.of((light,) * 6), RigKind.of((cone,)))
    }
    assert [choice.effects.shadows for choice in decided.values()] == [False, True, True]
    assert [choice.effects.cones for choice in decided.values()] == [False, False, True]


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(["gaussian", "smoothstep", "linear"]),
    st.floats(0.05, pi),
    st.floats(0.0, 1.0),
    st.floats(0.0, pi),
)
def test_no_direction_of_a_spot_differs_from_a_point_light_by_more_than_the_bound(
    profile, cone, falloff, angle
) -> None:
    shape = SpotLight.shaped(profile, cone, falloff)
    relative, smallest = (
        float(shape.relative_intensity_at(torch.tensor(angle, dtype=torch.float64))),
        shape.least_relative_intensity,
    )
    assert smallest <= relative + 1e-12
    if cone_bound(smallest) < NO_BOUND:
        # Of the brightest, which has at least the smallest part.
        assert (1.0 - relative) / smallest <= cone_bound(smallest) * (1.0 + 1e-9)


def test_effects_left_out_together_stay_within_the_tolerance() -> None:
    shadows = ShadowBound(point=2e-4, spot=1.0, proved=False, lights=100, uniform=80)
    bounds = EffectBounds(interreflection=7e-4, row_sum=7e-4, shadows=shadows, specular=6e-4)
    choice = choose_effects(bounds, 1.1e-3, ONE_POINT)
    left_out = [decision for decision in choice.decisions if not decision.simulated]
    assert sum(decision.bound for decision in left_out) <= 1.1e-3
    effects = choice.effects
    assert not effects.shadows and not effects.lobes and effects.interreflection
    assert choose_effects(bounds, 1.0, ONE_POINT).effects.interreflection is False
    assert choose_effects(DARK, 0.0, ONE_POINT).decisions == choose_effects(DARK, 1.0, ONE_POINT).decisions


def test_reasons_say_what_why_and_how_much() -> None:
    bounds = replace(DARK, interreflection=2.0, row_sum=0.6)
    costs = {"shadows": 5.0, "interreflection": 3.0, "spot cones": 1.0}
    reasons = choose_effects(bounds, 1e-3, ONE_POINT, milliseconds=costs).reasons
    assert [reason.startswith(name) for reason, name in zip(reasons, EFFECTS, strict=True)] == [True] * 4
    assert reasons[0] == "shadows left out: no surfel rises above the plane of another, saves 5.0 ms a step"
    assert "simulated: can change 2 times the brightest" in reasons[1] and "costs 3.0 ms" in reasons[1]
    assert reasons[2] == "spot cones left out: the rig has no spots"
    off = choose_effects(bounds, 1e-3, ONE_POINT, off=["interreflection"])
    assert not off.effects.interreflection and off.reasons[1] == "interreflection left out: as configured"


def test_bounds_survive_being_written() -> None:
    bounds = measure_effects(frozen(closed_box(1 / 6, 0.5)), seed=0)
    assert EffectBounds.from_json(asdict(bounds)) == bounds


def test_a_gloss_too_faint_to_see_is_left_out() -> None:
    faint, visible = (
        measure_effects(frozen(EFFECT_SCENES[name].build(900)), seed=0) for name in ("faint gloss", "glossy box")
    )
    assert 0.0 < faint.specular < 1e-3 < visible.specular
    left_out, kept = (choose_effects(bounds, 1e-3, ONE_POINT).effects for bounds in (faint, visible))
    assert kept.lobes and not left_out.lobes


def test_costs_name_effects() -> None:
    assert set(measure_costs(frozen(ball(100, 0.5)))) == {"shadows", "interreflection", "spot cones"}
    assert set(measure_costs(frozen(EFFECT_SCENES["faint gloss"].build(100)))) == set(EFFECTS)


def test_only_views_that_see_past_the_scene_have_a_background() -> None:
    room, outside = frozen(closed_box(1 / 8)), frozen(ball(700, 0.5))
    inside = Camera.from_field_of_view(look_at(torch.tensor([0.0, -0.4, 0.0]), torch.zeros(3)), 0.9, 12, 12)
    far = EFFECT_SCENES["dark ball"].camera(12)
    # Rays that meet a surface count as covered in full. Measured 0 and 1.
    assert void_share([room.view(inside)]) < 1e-6 and void_share([outside.view(far)]) > 0.99
    assert void_share([]) == 0.0
