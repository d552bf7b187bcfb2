"""Direct light where pixels look: lights in hard places, hard scenes and hard cameras, against float64."""

from __future__ import annotations

import pytest
import torch

from double_precision import in_double
from hard_cases import CAMERAS, GEOMETRIES, INSIDE, LIGHTS, SCENES, HardScene, camera, scene_of_light
from rgspipe.renderer import reference
from rgspipe.renderer.kernels.irradiance import SOFTENING
from rgspipe.renderer.kernels.pixel_light import PixelLight
from rgspipe.renderer.kernels.pixel_rays import pixel_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import PixelDirect, surfel_transmittance
from rgspipe.renderer.view_weights import build_view_weights


def compare(scene: HardScene, light: torch.Tensor, within, camera_name: str = "plain", smooth: bool = True) -> None:
    """The image in units of 1/size² and its derivative in units of 1/size³, at given parts of the light."""
    surfels, seen, position = scene.build(), camera(camera_name, scene), scene.at(light)
    exact, bvh = in_double(surfels), SurfelBvh(surfels)
    view = build_view_weights(bvh, seen, supersampling=2)
    passing = torch.rand(len(surfels), generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    unknown = torch.full((seen.pixel_count,), -1.0, dtype=torch.float64)
    softening = float(SOFTENING) * exact.scales.prod(dim=1).sqrt()
    prepared = PixelLight(bvh, view.operator.matrix, view.edges, pixel_rays(bvh, seen), softening)
    own = torch.cat([unknown[:, None], torch.zeros(len(unknown), 3)], dim=1).float()
    found = prepared.image(position, passing, torch.zeros(len(surfels), 3), own)
    weights = torch.from_numpy(view.operator.to_scipy().toarray()).double()

    def image(place: torch.Tensor) -> torch.Tensor:
        return reference.direct_image(exact, weights, view.edges, seen, place, passing, unknown)

    expected = image(position.double())
    slope = torch.autograd.functional.jacobian(image, position.double(), vectorize=True, strategy="forward-mode")
    # Measured at most 8e-6, and 1e-4 in single pixels; 4e-7 and 7e-7 of the derivative.
    within("image", found[:, :, 0] * scene.size**2, expected * scene.size**2, 5e-5, outliers=0.01, cap=1e-3)
    if not smooth:
        assert torch.isfinite(found).all()
        return
    within("derivative", found[:, :, 1:] * scene.size**3, slope * scene.size**3, 1e-5, outliers=0.01, cap=1e-4)


@pytest.mark.parametrize("light", LIGHTS)
def test_a_light_in_a_hard_place(light: str, within) -> None:
    # In the plane of a surfel the cosine has a kink: the derivative is that of either side.
    compare(scene_of_light(light), LIGHTS[light], within, smooth=light not in ("on a surfel", "grazing"))


@pytest.mark.parametrize("name", [name for name in GEOMETRIES if name != "no surfel"])
def test_a_light_in_a_hard_scene(name: str, within) -> None:
    compare(SCENES[name], INSIDE, within)


@pytest.mark.parametrize("name", CAMERAS)
def test_a_hard_camera(name: str, within) -> None:
    compare(SCENES["plain"], INSIDE, within, name)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("name", GEOMETRIES)
def test_every_light_in_every_scene_is_finite_with_shadows_of_pixels(name: str, light: str) -> None:
    scene = SCENES[name]
    bvh, position = SurfelBvh(scene.build()), scene.at(LIGHTS[light])
    direct = PixelDirect(bvh, build_view_weights(bvh, camera("plain", scene), supersampling=2))
    assert torch.isfinite(direct.image(position, *surfel_transmittance(bvh, position))).all()
