"""Gauss-Newton for the albedo: its derivative is that of images with all bounces, and white rooms are solved."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.datasets.views import View
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Camera, PointLight, Surfels, look_at
from rgspipe.scene.rectangles import inside_of_box, solid_box, surfels_on
from rgspipe.training.albedo import ALBEDO_RANGE, AlbedoProblem
from rgspipe.training.albedo_solve import Linearised, Quadratic, no_worse, pull
from rgspipe.training.lighting import Lighting, indirect_irradiance, trace_lighting
from rgspipe.training.likeness import graph_laplacian
from rgspipe.training.materials import build_frozen, fit_materials, trace_views
from rgspipe.training.options import MaterialOptions
from rgspipe.training.ties import Ties
from rgspipe.training.view_model import build_view_models

OPTIONS = MaterialOptions(rounds=5, gather_rays=64, patches=120, supersampling=1)


def room_of(albedo: float) -> Surfels:
    """A closed room with a darker box in it."""
    walls = inside_of_box([0, 0, 0], [1, 1, 1], [albedo, 0.97 * albedo, 0.94 * albedo])
    return surfels_on(walls + solid_box([0.1, 0.2, -0.35], [0.3] * 3, [0.2, 0.4, 0.6]), 1000).to(torch.float32)


def views_of(one_side: bool, count: int = 16, resolution: int = 24) -> list[View]:
    """Of no colour yet; from anywhere, or through narrow lenses from along one wall, which none of them sees."""
    generator = torch.Generator().manual_seed(3)
    views = []
    for index in range(count):
        origin, target, lamp = (0.8 * (torch.rand(3, generator=generator) - 0.5) for _ in range(3))
        lamp[2] = 0.1 + 0.4 * lamp[2].abs()
        if one_side:
            origin[1], target[1] = -0.42, 0.3
        angle = 1.0 if one_side else 1.4
        camera = Camera.from_field_of_view(look_at(origin, target), angle, resolution, resolution)
        blank, alpha = torch.zeros(resolution, resolution, 3), torch.ones(resolution, resolution)
        light = PointLight(lamp.double(), torch.tensor([1.0, 0.8, 1.2], dtype=torch.float64))
        views.append(View(f"train/{index}", camera, blank, alpha, light))
    return views


def photographed(room: Surfels, views: list[View], noise: float) -> tuple[list[View], torch.Tensor]:
    """The views with images, all bounces included, and which surfels (N,) they show."""
    bvh = SurfelBvh(room)
    lighting, weights = trace_lighting(bvh, views), trace_views(room, views, 1)
    indirect = indirect_irradiance(lighting, room.albedo, build_frozen(room, OPTIONS).transport)
    models = build_view_models(bvh, weights, lighting, True)
    generator, found = torch.Generator().manual_seed(0), []
    for v, view in enumerate(views):
        image = models[v].image(room.albedo, indirect[v])
        image = image * (1.0 + noise * torch.randn(image.shape, generator=generator))
        found.append(replace(view, image=image.reshape(view.image.shape)))
    shown = sum(torch.from_numpy(w.operator.to_scipy().sum(axis=0).A1) for w in weights)
    return found, shown > 1.0


@pytest.fixture(scope="module")
def linear() -> tuple[Linearised, AlbedoProblem, Lighting, Surfels]:
    """Images of a bright room, at a wrong albedo."""
    room = room_of(0.8)
    views, _ = photographed(room, views_of(False, count=4), 0.0)
    bvh = SurfelBvh(room)
    lighting = trace_lighting(bvh, views)
    problem = AlbedoProblem.build(room, build_view_models(bvh, trace_views(room, views, 1), lighting, True), views)
    start = torch.full_like(room.albedo, 0.6)
    return Linearised.of(problem, lighting, start, build_frozen(room, OPTIONS).transport), problem, lighting, room


def test_the_change_is_the_derivative_of_images_with_all_bounces(linear: tuple) -> None:
    at = linear[0]
    change = torch.rand(at.albedo.shape, generator=torch.Generator().manual_seed(1)) - 0.3
    step = 2e-3
    ahead, behind = at.moved(step * change), at.moved(-step * change)
    for found, more, less in zip(at.change(change), ahead.renders, behind.renders, strict=True):
        expected = (more - less) / (2.0 * step)
        # Measured 5e-5 of the largest: float32 images, and steps of this length.
        assert float((found - expected).abs().max()) < 5e-4 * float(expected.abs().max())


def test_the_transpose_belongs_to_the_change(linear: tuple) -> None:
    at, generator = linear[0], torch.Generator().manual_seed(2)
    change = torch.rand(at.albedo.shape, generator=generator)
    pixels = [torch.rand(image.shape, generator=generator) for image in at.renders]
    forward = sum(float((a * b).double().sum()) for a, b in zip(at.change(change), pixels, strict=True))
    backward = float((at.transposed(pixels) * change).double().sum())
    assert backward == pytest.approx(forward, rel=1e-5)  # measured 2e-7


def test_without_bounces_only_direct_light_changes(linear: tuple) -> None:
    at, problem, lighting, _ = linear
    alone = Linearised.of(problem, lighting, at.albedo, None)
    for found, expected in zip(alone.change(at.albedo), alone.renders, strict=True):
        assert torch.equal(found, expected)


def test_a_step_that_leads_too_far_is_halved(linear: tuple) -> None:
    """From 0.6 the whole step leads to images that are worse: light that bounces grows faster than its derivative."""
    at, problem, _, room = linear
    laplacian = graph_laplacian(problem.neighbours, room.normals.float(), None)
    quadratic = Quadratic.of(at, problem.photographs.weights(), laplacian, pull(None, at.albedo))
    step = quadratic.step(Ties(room))
    assert quadratic.loss(at.moved(step)) > 2.0 * quadratic.loss(at)  # measured 2.4
    assert quadratic.loss(no_worse(at, quadratic, step)) < 0.5 * quadratic.loss(at)


def test_a_step_that_makes_all_worse_is_not_taken(linear: tuple) -> None:
    at, problem, _, room = linear
    laplacian = graph_laplacian(problem.neighbours, room.normals.float(), None)
    quadratic = Quadratic.of(at, problem.photographs.weights(), laplacian, pull(None, at.albedo))
    assert no_worse(at, quadratic, torch.full_like(at.albedo, -10.0)) is at


@pytest.mark.parametrize("one_side", [False, True])
@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.95])
def test_rooms_in_which_light_bounces_many_times_are_solved(albedo: float, one_side: bool) -> None:
    """Images with 3 % noise. With the light that bounces taken from the round before, 0.9 and 0.95 ended 0.06 off."""
    room = room_of(albedo)
    views, seen = photographed(room, views_of(one_side), 0.03)
    grey = replace(room, albedo=torch.full_like(room.albedo, 0.5))
    found = fit_materials(grey, views, OPTIONS).surfels.albedo
    error = (found - room.albedo).abs().mean(dim=1)
    assert float(error[seen].mean()) < 0.03
    assert float((found[seen] >= ALBEDO_RANGE[1]).float().mean()) < 0.02
    if one_side:
        # No image shows them: the light that they send onto what is seen tells.
        assert abs(float((found - room.albedo)[~seen].mean())) < 0.05
