"""Hard cases stay finite, agree with float64, and the optimiser goes on afterwards."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from hard_cases import INSIDE, LIGHTS, SCENES, room
from rgspipe.fitting import fit_lights, prepare_fit
from rgspipe.fitting.dictionary import build_dictionary
from rgspipe.fitting.fit import FitViews
from rgspipe.renderer import reference
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.shade import shade_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, PointLight, look_at

SIZE_OF = {"a scene of size 1e-3": 1e-3, "a scene of size 1e3": 1e3}


def rays(size: float = 1.0, count: int = 200) -> tuple[Tensor, Tensor]:
    generator = torch.Generator().manual_seed(0)
    directions = torch.nn.functional.normalize(torch.randn(count, 3, generator=generator, dtype=torch.float64), dim=1)
    return size * INSIDE.expand(count, 3).contiguous(), directions


def assert_finite(**tensors: Tensor) -> None:
    for name, tensor in tensors.items():
        assert torch.isfinite(tensor).all(), f"{name} holds NaN or Inf"


@pytest.mark.parametrize("scene", SCENES)
def test_composite(scene: str) -> None:
    surfels, size = SCENES[scene](), SIZE_OF.get(scene, 1.0)
    origins, directions = rays(size)
    hits = composite(SurfelBvh(surfels.to(torch.float32)), origins, directions, nearest=1e-4 * size)
    assert_finite(weights=hits.weights, transmittance=hits.transmittance)
    if len(surfels) == 0 or scene == "a thousand layers":
        return
    usable = replace(surfels, scales=surfels.scales.clamp(min=1e-7 * float(surfels.scales.max())))
    weights, passing = reference.composite_dense(usable, origins, directions, nearest=1e-4 * size)
    dense = torch.zeros_like(weights)
    ray, column = (hits.indices >= 0).nonzero(as_tuple=True)
    dense.index_put_((ray, hits.indices[ray, column].long()), hits.weights[ray, column].double(), accumulate=True)
    if scene == "coincident duplicates":  # which of two equal surfels comes first is a matter of rounding
        half = len(surfels) // 2
        dense, weights = dense[:, :half] + dense[:, half:], weights[:, :half] + weights[:, half:]
    # A hit whose α is within rounding of the smallest may fall on either side of it: measured at most 1e-2 there.
    assert float((dense - weights).abs().mean()) < 1e-6
    assert float((hits.transmittance.double() - passing).abs().max()) < 2e-2


@pytest.mark.parametrize("scene", [name for name in SCENES if name != "no surfel"])
def test_shading_gradients(scene: str) -> None:
    surfels, size = SCENES[scene]().to(torch.float32), SIZE_OF.get(scene, 1.0)
    names = ("centers", "rotations", "scales", "opacities", "clip_offsets", "clip_angles")
    leaves = {name: getattr(surfels, name).clone().requires_grad_() for name in names}
    surfels = replace(surfels, **leaves)
    thresholds = torch.tensor([surfels.coverage.low, surfels.coverage.high], requires_grad=True)
    origins, directions = rays(size)
    view = torch.zeros(len(origins), dtype=torch.int32)
    colours = shade_rays(
        SurfelBvh(surfels), surfels, thresholds, torch.ones(1, len(surfels), 3), origins, directions, view
    )
    colours.square().sum().backward()
    assert_finite(colours=colours, thresholds=thresholds.grad, **{name: leaf.grad for name, leaf in leaves.items()})


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("scene", SCENES)
def test_irradiance_and_derivative(scene: str, light: str) -> None:
    surfels, size = SCENES[scene](), SIZE_OF.get(scene, 1.0)
    position = size * LIGHTS[light][None]
    irradiance, slope = unit_irradiance(SurfelBvh(surfels.to(torch.float32)), position)
    assert_finite(irradiance=irradiance, slope=slope)
    assert float(irradiance.min()) >= 0.0 if len(surfels) else True


@pytest.mark.parametrize("light", LIGHTS)
def test_geometry_factor_in_float32_agrees_with_float64(light: str) -> None:
    surfels = room()
    scales = surfels.scales.prod(dim=1).sqrt()
    arguments = (LIGHTS[light][None], surfels.centers, surfels.normals, scales)
    exact, exact_slope = reference.geometry_factor(*arguments)
    found, found_slope = reference.geometry_factor(*(x.float() for x in arguments))
    # Measured up to 6e-6 of the largest value: 1e-6 beside a wall at 0.5 float32 knows the place to 3e-8 only.
    assert float((found - exact).abs().max()) <= 3e-5 * float(exact.max())
    assert float((found_slope - exact_slope).abs().max()) <= 3e-5 * float(exact_slope.abs().max())


@pytest.mark.parametrize("scene", [name for name in SCENES if name != "no surfel"])
def test_a_frozen_scene_and_its_light_transport(scene: str) -> None:
    surfels, size = SCENES[scene](), SIZE_OF.get(scene, 1.0)
    frozen = FrozenScene.freeze(surfels, gather_rays=16, patches=20, seed=0)
    position = (size * INSIDE).clone().requires_grad_()
    radiance = frozen.radiance_of((PointLight(position, torch.ones(3)),))
    radiance.sum().backward()
    assert_finite(radiance=radiance, position=position.grad)
    assert float(radiance.detach().min()) >= -1e-5 * float(radiance.detach().abs().max())


@pytest.fixture(scope="module")
def frozen() -> FrozenScene:
    return FrozenScene.freeze(room(), gather_rays=32, patches=40, seed=0)


CAMERAS = {
    "plain": ([0.4, -0.4, 0.3], [0.0, 0.0, 0.0], 16),
    "in a surfel": ([-0.5, 0.0625, 0.0625], [0.0, 0.0, 0.0], 16),
    "looking at nothing": ([0.0, 0.0, 5.0], [0.0, 0.0, 9.0], 16),
    "of one pixel": ([0.4, -0.4, 0.3], [0.0, 0.0, 0.0], 1),
}


def camera(name: str) -> Camera:
    origin, target, resolution = CAMERAS[name]
    return Camera.from_field_of_view(look_at(torch.tensor(origin), torch.tensor(target)), 1.2, resolution, resolution)


@pytest.mark.parametrize("name", CAMERAS)
def test_cameras(frozen: FrozenScene, name: str) -> None:
    image = frozen.render(frozen.view(camera(name)), (PointLight(INSIDE, torch.ones(3)),))
    assert_finite(image=image)
    assert float(image.min()) >= 0.0


def prepare(frozen: FrozenScene, view: ViewWeights) -> FitViews:
    return prepare_fit(frozen, [view], dictionary=build_dictionary(frozen, 5, seed=0))


@pytest.mark.parametrize("method", ["search_lm", "paper_adam"])
@pytest.mark.parametrize("exponent", [-30.0, 0.0, 30.0])
def test_fits_at_the_ends_of_the_intensity_range(frozen: FrozenScene, method: str, exponent: float) -> None:
    """From log-intensity −30 to 30 the answer is finite, and the search finds the light as it does at 0."""
    view = frozen.view(camera("plain"))
    light = PointLight(INSIDE, torch.exp(torch.full((3,), exponent, dtype=torch.float64)))
    image = frozen.render(view, (light,))
    lamps = [PointLight(INSIDE + 0.1, light.intensity), PointLight(INSIDE - 0.1, light.intensity)]
    fit = fit_lights(frozen, prepare(frozen, view), [image], method=method, training_lights=lamps, seed=0)
    assert fit.lights
    assert_finite(position=fit.lights[0].position, intensity=fit.lights[0].intensity)
    if method == "search_lm":
        # Measured 2e-5.
        assert float((fit.lights[0].position - INSIDE).norm()) < 5e-3


def test_sixteen_orders_of_magnitude_in_one_image(frozen: FrozenScene) -> None:
    view = frozen.view(camera("plain"))
    image = frozen.render(view, (PointLight(INSIDE, torch.ones(3)),))
    image = image * torch.logspace(-8, 8, image.shape[0])[:, None, None]
    fit = fit_lights(frozen, prepare(frozen, view), [image], method="search_lm", seed=0)
    assert_finite(position=fit.lights[0].position, intensity=fit.lights[0].intensity)


def test_a_solver_with_albedo_one_ends() -> None:
    surfels = SCENES["albedo 1 in a closed room"]()
    frozen = FrozenScene.freeze(surfels, gather_rays=16, patches=20, seed=0)
    energy = frozen.radiance_of((PointLight(INSIDE, torch.ones(3)),))
    assert_finite(energy=energy)
    # Albedo 1 counts as 0.999: the room holds at most a thousand times the direct light.
    direct = frozen.radiance_of((PointLight(INSIDE, torch.ones(3)),), indirect=False)
    assert float(energy.mean()) <= 1100.0 * float(direct.mean())
