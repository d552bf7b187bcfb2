"""Albedo from images: what the linear problem holds, and what pulls where images say nothing."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.datasets.views import View
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Camera, PointLight, Surfels, look_at
from rgspipe.scene.rectangles import inside_of_box, solid_box, surfels_on
from rgspipe.training.albedo import AlbedoPrior, AlbedoProblem
from rgspipe.training.lighting import indirect_irradiance, trace_lighting
from rgspipe.training.materials import build_frozen, fit_materials, trace_views
from rgspipe.training.options import MaterialOptions
from rgspipe.training.view_model import LitViewModel, build_view_models

OPTIONS = MaterialOptions(rounds=5, gather_rays=32, patches=60, supersampling=1)


@pytest.fixture(scope="module")
def room() -> Surfels:
    """A closed room with a box in it, about 600 surfels."""
    walls = inside_of_box([0, 0, 0], [1, 1, 1], [0.6, 0.5, 0.4])
    return surfels_on(walls + solid_box([0, 0, -0.35], [0.3] * 3, [0.2, 0.4, 0.6]), 600).to(torch.float32)


def unlit_views(count: int = 8, resolution: int = 24) -> list[View]:
    generator = torch.Generator().manual_seed(3)
    found = []
    for index in range(count):
        origin, target, light = (0.8 * (torch.rand(3, generator=generator) - 0.5) for _ in range(3))
        origin[2], light[2] = origin[2].abs(), 0.1 + 0.5 * light[2].abs()
        camera = Camera.from_field_of_view(look_at(origin, target - origin), 1.4, resolution, resolution)
        lamp = PointLight(light.double(), torch.tensor([1.0, 0.8, 1.2], dtype=torch.float64))
        blank = torch.zeros(resolution, resolution, 3)
        found.append(View(f"train/{index}", camera, blank, torch.ones(resolution, resolution), lamp))
    return found


def models_of(surfels: Surfels, views: list[View], at_pixels: bool) -> tuple[LitViewModel, ...]:
    bvh = SurfelBvh(surfels)
    return build_view_models(bvh, trace_views(surfels, views, 1), trace_lighting(bvh, views), at_pixels)


@pytest.fixture(scope="module")
def photographs(room: Surfels) -> list[View]:
    """Views of the room with light where pixels look and all bounces."""
    views = unlit_views()
    lighting = trace_lighting(SurfelBvh(room), views)
    indirect = indirect_irradiance(lighting, room.albedo, build_frozen(room, OPTIONS).transport)
    models = models_of(room, views, at_pixels=True)
    return [
        replace(view, image=models[v].image(room.albedo, indirect[v]).reshape(view.image.shape))
        for v, view in enumerate(views)
    ]


@pytest.mark.parametrize("at_pixels", [True, False])
def test_the_transposed_model_and_its_diagonal_belong_to_the_model(room: Surfels, at_pixels: bool) -> None:
    model = models_of(room, unlit_views(1), at_pixels)[0]
    generator = torch.Generator().manual_seed(0)
    albedo, indirect = (torch.rand(len(room), 3, generator=generator) for _ in range(2))
    pixels, weight = torch.rand(24 * 24, 3, generator=generator), torch.rand(24 * 24, generator=generator)
    forward = (model.image(albedo, indirect) * pixels).double().sum()
    backward = (model.transposed(pixels, indirect) * albedo).double().sum()
    # Measured 1e-7.
    assert float(backward) == pytest.approx(float(forward), rel=1e-5)
    direct, weights = model.direct.to_scipy().toarray(), model.weights.operator.to_scipy().toarray()
    column = 1
    dense = torch.from_numpy(direct) * model.intensity[column] + torch.from_numpy(weights) * indirect[:, column]
    expected = (weight[:, None] * dense.square()).sum(dim=0)
    # Measured 3e-7 of the largest.
    found = model.squared(weight, indirect)[:, column]
    assert float((found - expected).abs().max()) < 1e-5 * float(expected.max())


def test_light_at_pixels_finds_albedo_that_light_at_centres_misses(room: Surfels, photographs: list[View]) -> None:
    grey = replace(room, albedo=torch.full_like(room.albedo, 0.5))
    weights = trace_views(room, photographs, 1)
    seen = torch.from_numpy(sum(view.operator.to_scipy().sum(axis=0).A1 for view in weights)) > 3.0
    errors = []
    for at_pixels in (True, False):
        found = fit_materials(grey, photographs, replace(OPTIONS, at_pixels=at_pixels)).surfels.albedo
        errors.append(float((found - room.albedo)[seen].abs().mean()))
    # Measured 0.0072 and 0.0089; of the first, the likeness of neighbours is most.
    assert errors[0] < 0.9 * errors[1]


def test_a_prior_decides_where_no_image_looks(room: Surfels, photographs: list[View]) -> None:
    known = torch.tensor([0.2, 0.4, 0.6]).expand(len(room), 3)

    def prior(surfels: Surfels) -> AlbedoPrior:
        return AlbedoPrior(known, torch.full((len(surfels),), 0.3))

    grey = replace(room, albedo=torch.full_like(room.albedo, 0.5))
    one = photographs[:1]
    seen = trace_views(room, one, 1)[0].operator.to_scipy().sum(axis=0).A1 > 0.0
    unseen = torch.from_numpy(~seen)
    pulled = fit_materials(grey, one, OPTIONS, prior=prior).surfels.albedo
    free = fit_materials(grey, one, OPTIONS).surfels.albedo
    # Measured 0.058 and 0.20: what the room sends back into the image speaks against a prior that is wrong.
    assert float((pulled - known)[unseen].abs().median()) < 0.08
    assert float((free - known)[unseen].abs().median()) > 0.1


def test_a_lamp_that_something_unseen_shades_makes_nothing_black(room: Surfels, photographs: list[View]) -> None:
    """One of eight photographs is a thousand times darker than its lamp would have it, as of a lamp in a cupboard."""
    grey = replace(room, albedo=torch.full_like(room.albedo, 0.5))
    shaded = [replace(view, image=view.image * (1e-3 if v == 3 else 1.0)) for v, view in enumerate(photographs)]
    found, expected = (fit_materials(grey, views, OPTIONS).surfels.albedo for views in (shaded, photographs))
    error = (found / expected - 1.0).abs()
    # Measured 0.004 and 0.065; 0.63 and 0.99 where errors were measured against the photograph's own peak.
    assert float(error.median()) < 0.02 and float(error.quantile(0.9)) < 0.1


def test_pixels_where_surfels_overhang_the_object_say_nothing(room: Surfels) -> None:
    view = unlit_views(1)[0]
    alpha = torch.ones(24, 24)
    alpha[:, 12:] = 0.0
    view = replace(view, image=torch.ones(24, 24, 3) * alpha[..., None], alpha=alpha)
    problem = AlbedoProblem.build(room, models_of(room, [view], at_pixels=False), [view])
    trust = problem.photographs.trust[0].reshape(24, 24)
    assert bool((trust[:, :12] == 1.0).all()) and bool((trust[:, 12:] == 0.0).all())
