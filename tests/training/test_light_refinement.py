"""Lights that were measured with errors come back from the images, and the mean of the errors stays."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.datasets.views import View
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.transport import PatchTransport
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, PointLight, Surfels, look_at
from rgspipe.scene.rectangles import inside_of_box, solid_box, surfels_on
from rgspipe.training.light_refinement import in_gauge, log_gains, refine_lights
from rgspipe.training.lighting import indirect_irradiance, trace_lighting
from rgspipe.training.materials import build_frozen, trace_views
from rgspipe.training.options import MaterialOptions
from rgspipe.training.view_model import build_view_models

COUNT, RESOLUTION = 8, 32


@pytest.fixture(scope="module")
def scene() -> tuple[Surfels, list[View], tuple[ViewWeights, ...], PatchTransport]:
    """A closed room with a box, and photographs of it under lights that are known exactly."""
    walls = inside_of_box([0, 0, 0], [1, 1, 1], [0.6, 0.5, 0.4])
    surfels = surfels_on(walls + solid_box([0, 0, -0.35], [0.3] * 3, [0.2, 0.4, 0.6]), 900).to(torch.float32)
    generator = torch.Generator().manual_seed(3)
    blank, views = torch.zeros(RESOLUTION, RESOLUTION, 3), []
    for index in range(COUNT):
        origin, target, light = (0.7 * (torch.rand(3, generator=generator) - 0.5).double() for _ in range(3))
        origin[2], light[2] = origin[2].abs(), 0.1 + 0.5 * light[2].abs()
        camera = Camera.from_field_of_view(look_at(origin, target - origin), 1.4, RESOLUTION, RESOLUTION)
        lamp = PointLight(light, torch.tensor([1.0, 0.8, 1.2], dtype=torch.float64))
        views.append(View(f"train/{index}", camera, blank, blank[..., 0] + 1.0, lamp))
    weights = trace_views(surfels, views, 1)
    bvh, transport = SurfelBvh(surfels), build_frozen(surfels, MaterialOptions(gather_rays=64, patches=100)).transport
    lighting = trace_lighting(bvh, views)
    indirect = indirect_irradiance(lighting, surfels.albedo, transport)
    models = build_view_models(bvh, weights, lighting, at_pixels=True)
    images = [models[v].image(surfels.albedo, indirect[v]).reshape(blank.shape) for v in range(COUNT)]
    return surfels, [replace(view, image=image) for view, image in zip(views, images, strict=True)], weights, transport


def measured_lights(views: list[View]) -> list[PointLight]:
    """The lights with errors of 0.02 a coordinate and 10 %, whose mean is zero."""
    generator = torch.Generator().manual_seed(1)
    moved, gains = (torch.randn(COUNT, 3, generator=generator).double() for _ in range(2))
    moved, gains = 0.02 * (moved - moved.mean(dim=0)), 0.1 * (gains - gains.mean(dim=0))
    return [
        PointLight(view.light.position + shift, view.light.intensity * gain.exp())
        for view, shift, gain in zip(views, moved, gains, strict=True)
    ]


def test_wrong_lights_are_put_right(scene) -> None:
    surfels, truth, weights, transport = scene
    measured = measured_lights(truth)
    wrong = [replace(view, light=light) for view, light in zip(truth, measured, strict=True)]
    found = refine_lights(SurfelBvh(surfels), weights, transport, wrong, measured)
    offsets = [float((a.light.position - b.light.position).norm()) for a, b in zip(found, truth, strict=True)]
    gains = [float((a.light.intensity / b.light.intensity - 1).abs().max()) for a, b in zip(found, truth, strict=True)]
    # Measured 4e-5 and 7e-5.
    assert max(offsets) < 3e-4 and max(gains) < 5e-4, (offsets, gains)


def test_what_all_lights_are_wrong_by_stays(scene) -> None:
    """Half the intensity and a shift in all measured lights: the gauge keeps both in the mean."""
    surfels, truth, weights, transport = scene
    shift = torch.tensor([0.01, 0.0, -0.01], dtype=torch.float64)
    measured = [PointLight(view.light.position + shift, 0.9 * view.light.intensity) for view in truth]
    wrong = [replace(view, light=light) for view, light in zip(truth, measured, strict=True)]
    found = refine_lights(SurfelBvh(surfels), weights, transport, wrong, measured)
    moved = torch.stack([a.light.position - b.position for a, b in zip(found, measured, strict=True)]).mean(dim=0)
    pairs = zip(found, measured, strict=True)
    gain = torch.stack([(a.light.intensity / b.intensity).log() for a, b in pairs]).mean(dim=0)
    # Zero by construction; measured 1e-17 and 1e-8.
    assert float(moved.abs().max()) < 1e-12
    assert float(gain.abs().max()) < 1e-6


def test_a_view_that_shows_nothing_keeps_its_light(scene) -> None:
    surfels, truth, weights, transport = scene
    empty = [replace(view, alpha=torch.zeros(RESOLUTION, RESOLUTION)) for view in truth]
    lights = [view.light for view in truth]
    found = refine_lights(SurfelBvh(surfels), weights, transport, empty, lights)
    for view, light in zip(found, lights, strict=True):
        torch.testing.assert_close(view.light.position, light.position, atol=1e-12, rtol=0)


def test_red_lamps_are_put_right_among_white_ones(scene) -> None:
    surfels, truth, weights, transport = scene
    red = torch.tensor([1.0, 0.0, 0.0])
    coloured = [replace(truth[0], image=truth[0].image * red), *truth[1:]]
    measured = measured_lights(truth)
    measured[0] = replace(measured[0], intensity=measured[0].intensity * red.double())
    wrong = [replace(view, light=light) for view, light in zip(coloured, measured, strict=True)]
    found = [view.light for view in refine_lights(SurfelBvh(surfels), weights, transport, wrong, measured)]
    offsets = [float((light.position - view.light.position).norm()) for light, view in zip(found, truth, strict=True)]
    assert max(offsets) < 3e-4, offsets  # measured 4e-5
    assert all(light.intensity.isfinite().all() for light in found)
    assert float(found[0].intensity[1:].abs().max()) < 1e-6 < float(found[0].intensity[0])


def test_a_lamp_without_one_of_the_colours_leaves_the_others_theirs() -> None:
    """Red lamps say nothing of how bright all others are in green."""
    red, white = PointLight([0.0, 0.0, 0.5], [1.0, 0.0, 0.0]), PointLight([0.1, 0.0, 0.5], [1.0, 1.0, 1.0])
    brighter = replace(white, intensity=2.0 * white.intensity)
    gains = log_gains([red, brighter], [red, white])
    assert gains[0, 0] == 0.0 and gains[0, 1:].isnan().all()
    first, second = in_gauge([red, brighter], [red, white])
    torch.testing.assert_close(second.intensity, torch.tensor([2.0**0.5, 1.0, 1.0], dtype=torch.float64))
    assert first.intensity[1:].eq(0.0).all() and first.intensity.isfinite().all()
