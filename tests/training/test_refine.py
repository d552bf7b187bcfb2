"""Geometry by gradients: against finite differences, and on surfels that were spoiled on purpose."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from clouds import cloud, cloud_rays
from painted_room import LIGHT, painted_box, painted_views
from rgspipe.datasets.views import View
from rgspipe.renderer import reference
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Surfels
from rgspipe.scene.surfels import quaternion_to_axes, turn_in_plane
from rgspipe.training.lighting import total_irradiance, trace_lighting
from rgspipe.training.materials import build_frozen
from rgspipe.training.options import RefineOptions
from rgspipe.training.parameters import build_surfels, start_parameters, tilted
from rgspipe.training.refine import RefineState, refine
from rgspipe.training.shading import SurfelLight, shaded_radiance, surfel_lights
from rgspipe.training.trainer import refine_views, spacing_of_clips


@pytest.fixture(scope="module")
def views() -> list[View]:
    return painted_views()


@pytest.fixture(scope="module")
def radiance(views: list[View]) -> Tensor:
    """Of the true surfels under every view's light."""
    truth = painted_box()
    lighting = trace_lighting(SurfelBvh(truth), views)
    return total_irradiance(lighting, truth.albedo, build_frozen(truth, LIGHT).transport) * truth.albedo


def lights_of(count: int) -> list[SurfelLight]:
    generator = torch.Generator().manual_seed(3)

    def random(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator, dtype=torch.float64)

    return [SurfelLight(4.0 * random(3), 30.0 * random(3), random(count), 0.1 * random(count, 3)) for _ in range(2)]


@pytest.mark.parametrize("name", ["offset", "height", "tilt", "angle", "albedo"])
def test_images_change_with_the_geometry_as_finite_differences_say(name: str) -> None:
    """Through coverage and through shading at once, in float64 with the reference renderer."""
    base, (origins, directions) = cloud(12, seed=5), cloud_rays(60, seed=6)
    start = {key: value.double() for key, value in start_parameters(base).items()}
    generator = torch.Generator().manual_seed(8)
    direction = torch.randn(start[name].shape, generator=generator, dtype=torch.float64)
    lights, ray_view = lights_of(12), torch.arange(60) % 2

    def image(value: Tensor) -> Tensor:
        surfels = build_surfels(base, start | {name: value})
        radiance = shaded_radiance(surfels, lights)
        colours = reference.shade_rays(surfels, start["thresholds"], radiance, origins, directions, ray_view)
        return colours.square().sum()

    leaf = start[name].clone().requires_grad_()
    image(leaf).backward()
    step = 1e-6
    difference = (image(start[name] + step * direction) - image(start[name] - step * direction)) / (2 * step)
    assert abs(float(difference)) > 1e-4, "the image must depend on it for this to prove anything"
    # Measured up to 2e-9 relative.
    torch.testing.assert_close((leaf.grad * direction).sum(), difference, rtol=1e-6, atol=1e-9)


def test_light_of_surfels_adds_up_to_their_radiance(views: list[View], radiance: Tensor) -> None:
    truth = painted_box()
    lights = surfel_lights(truth, [view.light for view in views], radiance / truth.albedo)
    # Measured 1.2e-7 of 11.6: the direct part in torch is the kernel's.
    torch.testing.assert_close(shaded_radiance(truth, lights), radiance, rtol=1e-4, atol=1e-6)
    # Every surfel of a closed room gets light from the others; measured 0.19 and more.
    assert min(float(light.indirect.min()) for light in lights) > 0.0


def test_parameters_at_the_start_are_the_surfels_themselves() -> None:
    surfels = painted_box()
    built = build_surfels(surfels, start_parameters(surfels))
    for name, tensor in surfels.tensors().items():
        # Measured 6e-8.
        torch.testing.assert_close(getattr(built, name), tensor, atol=1e-6, rtol=1e-5)


def test_tilting_about_u_leans_the_normal_towards_minus_v() -> None:
    surfels = painted_box()
    u, v, normal = surfels.frames.unbind(1)
    angle = 0.3
    about_u = torch.tensor([[angle, 0.0]]).expand(len(surfels), 2)
    leaning = quaternion_to_axes(tilted(surfels.rotations, about_u))
    # Measured 2e-7.
    torch.testing.assert_close(leaning[:, 2], math.cos(angle) * normal - math.sin(angle) * v, atol=1e-5, rtol=0)
    torch.testing.assert_close(leaning[:, 0], u, atol=1e-5, rtol=0)
    about_v = quaternion_to_axes(tilted(surfels.rotations, about_u.flip(1)))
    torch.testing.assert_close(about_v[:, 2], math.cos(angle) * normal + math.sin(angle) * u, atol=1e-5, rtol=0)


def test_turning_in_the_plane_keeps_the_clips() -> None:
    surfels = painted_box()
    turned = turn_in_plane(surfels.rotations, torch.full((len(surfels),), math.pi / 2))
    before, after = quaternion_to_axes(surfels.rotations), quaternion_to_axes(turned)
    # Measured 2e-7: u goes to v, v to −u, the normal stays.
    torch.testing.assert_close(after[:, 0], before[:, 1], atol=1e-6, rtol=0)
    torch.testing.assert_close(after[:, 2], before[:, 2], atol=1e-6, rtol=0)
    built = build_surfels(surfels, start_parameters(surfels) | {"angle": torch.full((len(surfels),), 0.3)})
    along = torch.stack([built.clip_angles[:, 0].cos(), built.clip_angles[:, 0].sin()], 1)
    direction = torch.einsum("na,nac->nc", along, built.frames[:, :2])
    torch.testing.assert_close(direction, surfels.frames[:, 0], atol=1e-6, rtol=0)


def test_geometry_steps_lower_the_loss(views: list[View], radiance: Tensor) -> None:
    """Surfels that were shrunk, so that walls have gaps, grow back."""
    shrunk = replace(painted_box(), scales=0.8 * painted_box().scales)
    seen = refine_views(painted_box(), views, radiance)
    options = RefineOptions(steps=30, views_per_step=16, edge_pixels=150, interior_pixels=150, subsamples=1)
    refined, state = refine(shrunk, seen, spacing_of_clips(shrunk), options)
    # Measured: the loss falls by a factor of 150, and the scales grow by 1.26, to the truth's 1.25.
    assert sum(state.losses[-5:]) < 0.05 * sum(state.losses[:5])
    assert float((refined.scales / shrunk.scales).mean()) == pytest.approx(1.25, rel=0.1)


def test_gradients_turn_normals_back(views: list[View], radiance: Tensor) -> None:
    truth = painted_box()
    spoiled = replace(truth, rotations=tilted(truth.rotations, noise(truth, 0.1)))
    seen = refine_views(truth, views, radiance)
    options = RefineOptions(
        steps=40,
        views_per_step=8,
        edge_pixels=300,
        interior_pixels=500,
        subsamples=1,
        tilt_rate=0.01,
        smoothness_weight=0.01,
    )
    still = dict.fromkeys(("offset", "log_scales", "angle", "logit"), 0.0)
    refined, _ = refine(spoiled, seen, spacing_of_clips(truth), options, rates=still)
    before, after = normal_error(spoiled, truth), normal_error(refined, truth)
    # Measured: 7.4° to 1.0°; 5.2° without the smoothness, as surfels blend in pixels.
    assert after < 0.5 * before


def noise(surfels: Surfels, deviation: float) -> Tensor:
    """(N, 2) random turns [rad]."""
    return deviation * torch.randn(len(surfels), 2, generator=torch.Generator().manual_seed(1))


def normal_error(surfels: Surfels, truth: Surfels) -> float:
    """Mean angle [deg]."""
    cosine = (surfels.normals * truth.normals).sum(dim=1).clamp(-1.0, 1.0)
    return float(torch.rad2deg(torch.acos(cosine)).mean())


def test_a_rebased_refinement_goes_on_where_it_was(views: list[View], radiance: Tensor) -> None:
    truth = painted_box()
    seen = refine_views(truth, views, radiance)
    options = RefineOptions(steps=8, views_per_step=4, interior_pixels=100, subsamples=1, tilt_rate=0.01)
    half, state = refine(truth, seen, spacing_of_clips(truth), options, until=4)
    assert state.step == 4
    rebased = state.rebased(half)
    torch.testing.assert_close(build_surfels(half, rebased.parameters).centers, half.centers)
    assert all(bool((rebased.first[name] == state.first[name]).all()) for name in state.first)
    _, done = refine(half, seen, spacing_of_clips(truth), options, rebased)
    assert done.step == 8
    assert len(done.losses) == 8


def test_limits_hold_however_far_the_steps_go(views: list[View], radiance: Tensor) -> None:
    truth = painted_box()
    seen = refine_views(truth, views, radiance)
    options = RefineOptions(steps=4, views_per_step=2, interior_pixels=50, subsamples=1)
    wild = {"log_scales": 9.0, "albedo": 9.0, "logit": 99.0}
    refined, _ = refine(truth, seen, spacing_of_clips(truth), options, RefineState.start(truth), rates=wild)
    change = (refined.scales / truth.scales).log()
    assert float(change.min()) >= -1.5001
    assert float(change.max()) <= 0.6001
    assert float(refined.albedo.min()) > 0.0
    assert float(refined.albedo.max()) < 1.0
    assert float(refined.opacities.max()) < 0.9934
