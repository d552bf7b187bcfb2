"""Sharp images of a scene and their gradients towards every tensor of the lights: against float64 without kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

import pytest
import torch
from torch import Tensor

from double_precision import DoubleTransport
from rgspipe.renderer import reference
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import SurfelModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.images.recent_views import KEPT
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.pixel_direct import LIT_OR_NOT, SHADOW_RAYS, PixelDirect
from rgspipe.renderer.unit_light import OwnLight
from rgspipe.renderer.view_weights import build_view_weights, even_places
from rgspipe.scene import Camera, Gloss, PointLight, SpotLight, Surfels
from rgspipe.scene.lights import LedLight, Light
from rooms import closed_box, rectangle, surfels_on

PLACE, COLOUR, AXIS = [0.1, 0.05, 0.3], [1.0, 2.0, 0.5], [0.3, 0.8, -2.0]
LIGHTS = {
    "point": PointLight(PLACE, COLOUR),
    "gaussian": SpotLight(PLACE, COLOUR, AXIS, "gaussian", 0.6, 0.3),
    "smoothstep": SpotLight(PLACE, COLOUR, AXIS, "smoothstep", 0.8, 0.5),
    "led": LedLight(PLACE, COLOUR, AXIS, 3.0),
}

CAMERA = Camera.look_at([0.35, -0.42, 0.3], [-0.1, 0.1, -0.3], fov_degrees=70, width=14, height=14)


@pytest.fixture(scope="module")
def surfels() -> Surfels:
    """A closed box with a screen in its middle."""
    walls, screen = (
        closed_box(1 / 6, 0.6),
        surfels_on(*rectangle([-0.2, -0.2, -0.1], [0.4, 0, 0], [0, 0.3, 0.1], 0.1), 0.1),
    )
    joined = {name: torch.cat([tensor, screen.tensors()[name]]) for name, tensor in walls.tensors().items()}
    return replace(walls, **joined)


@pytest.fixture(scope="module")
def frozen(surfels: Surfels) -> FrozenScene:
    return FrozenScene.freeze(surfels, gather_rays=64, patches=60, seed=0)


@pytest.fixture(scope="module")
def glossy(surfels: Surfels) -> FrozenScene:
    floor = surfels.centers[:, 2] < -0.45
    gloss = Gloss(torch.where(floor[:, None], 0.2, 0.0).expand(-1, 3).double(), torch.where(floor, 12.0, 1.0).double())
    return FrozenScene.freeze(replace(surfels, gloss=gloss), gather_rays=64, patches=60, seed=0)


def with_leaves(light: Light) -> tuple[Light, dict[str, Tensor]]:
    """The light with every number a float64 leaf, and these."""
    numbers = {
        one.name: getattr(light, one.name) for one in fields(light) if not isinstance(getattr(light, one.name), str)
    }
    leaves = {name: torch.as_tensor(value).double().clone().requires_grad_() for name, value in numbers.items()}
    return replace(light, **leaves), leaves


def exact_image(surfels: Surfels, frozen: FrozenScene, at: Light) -> Callable[[Light], Tensor]:
    """Images (P, 3) of lights near `at` in plain float64 torch: every ray against every surfel."""
    view = frozen.view(CAMERA)
    weights, edges = torch.from_numpy(view.operator.to_scipy().toarray()).double(), view.edges
    points = PixelDirect(frozen.bvh, view).points
    receivers, transport = weights.argmax(dim=1), DoubleTransport.of(frozen)
    lit = weights @ reference.transmittance(surfels, at.position[None])[0] / weights.sum(dim=1)
    pixels = (~edges & (lit > LIT_OR_NOT) & (lit < 1.0 - LIT_OR_NOT)).nonzero()[:, 0]
    assert len(pixels) > 10, "some pixels must lie on a shadow's edge for this to prove anything"
    _, directions, lengths = CAMERA.rays()
    axes, which = CAMERA.camera_to_world[:3, :3], receivers[pixels]

    def own_passing(position: Tensor) -> Tensor:
        total = torch.zeros(len(pixels), dtype=torch.float64)
        for x, y in (even_places(SHADOW_RAYS) - 0.5).tolist():
            rays = (directions * lengths[:, None])[pixels] + x * axes[:, 0] / CAMERA.fx + y * axes[:, 1] / CAMERA.fy
            places = reference.points_on_surfels(surfels, CAMERA.origin, rays, which, torch.inf)
            facing = ((position - places) * surfels.normals[which]).sum(1) > 0.0
            total = total + torch.where(facing, reference.transmittance_at(surfels, position, which, places), 0.0)
        return torch.full((len(weights),), -1.0).double().index_put((pixels,), total / SHADOW_RAYS)

    def image(light: Light) -> Tensor:
        position = light.position
        passing = reference.transmittance(surfels, position[None])[0]
        direct = reference.direct_image(surfels, weights, edges, CAMERA, position, passing, own_passing(position))
        irradiance = reference.unit_irradiance(surfels, position[None])[0]
        if light.axis is not None:
            direct = direct * light.relative_intensity_towards(points)[:, None]
            irradiance = irradiance * light.relative_intensity_towards(surfels.centers)
        radiance = transport.radiance(irradiance[:, None]) - transport.radiance(irradiance[:, None], indirect=False)
        return (direct + weights @ radiance[:, :, 0]) * light.intensity

    return image


@pytest.mark.parametrize("kind", LIGHTS)
def test_images_and_all_gradients_are_those_of_float64(surfels: Surfels, frozen: FrozenScene, kind: str) -> None:
    """Penumbrae, profiles and bounces in; gradients of a random functional against central differences."""
    light = LIGHTS[kind].detached()
    exact = exact_image(surfels, frozen, light)
    moving, leaves = with_leaves(light)
    found = frozen.render(CAMERA, moving)
    expected = exact(light)
    # Measured up to 2e-7 of the brightest.
    assert float((found.detach().reshape(-1, 3) - expected).abs().max()) < 2e-6 * float(expected.max())
    cotangent = torch.rand(expected.shape, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    (found.reshape(-1, 3).double() * cotangent).sum().backward()
    step = 1e-6
    for name, leaf in leaves.items():
        slope = torch.zeros(leaf.numel(), dtype=torch.float64)
        for index in range(leaf.numel()):
            shift = torch.zeros(leaf.numel(), dtype=torch.float64)
            shift[index] = step
            ends = [
                exact(replace(light, **{name: leaf.detach() + sign * shift.reshape(leaf.shape)})) for sign in (1, -1)
            ]
            slope[index] = ((ends[0] - ends[1]) * cotangent).sum() / (2.0 * step)
        # Measured up to 9e-7.
        assert float((leaf.grad.reshape(-1) - slope).norm()) < 1e-5 * float(slope.norm()), name


@pytest.mark.parametrize("scene", ["frozen", "glossy"])
@pytest.mark.parametrize("model", [SurfelModel, PixelModel])
@pytest.mark.parametrize("kind", ["point", "gaussian", "led"])
def test_an_image_and_its_gradient_are_the_columns_of_its_light(
    scene: str, model: type[SurfelModel | PixelModel], kind: str, request: pytest.FixtureRequest
) -> None:
    """Rigs bounce together and differentiate backwards, fits bounce every column: one result."""
    frozen = request.getfixturevalue(scene)
    seen = model.of(ViewedPixels.every(frozen, [frozen.view(CAMERA)]), Effects())
    moving, leaves = with_leaves(LIGHTS[kind])
    own = OwnLight(moving)
    columns = seen.columns(own)
    image = seen.image((moving,))
    intensity = moving.intensity.detach().float()
    # Measured up to 1.2e-7, and 8e-6 for the gradient.
    error = (image.detach() - columns[:, :, 0] * intensity).abs().max()
    assert float(error) < 2e-6 * float(image.detach().max())
    cotangent = torch.rand(image.shape, generator=torch.Generator().manual_seed(2))
    (image * cotangent).sum().backward()
    expected = torch.einsum("pcd,pc->d", columns[:, :, 1:], cotangent * intensity).double()
    found = torch.cat([leaves[name].grad.reshape(-1) for name in own.names])
    assert float((found - expected).norm()) < 1e-4 * float(expected.norm())


@pytest.mark.parametrize("scene", ["frozen", "glossy"])
@pytest.mark.parametrize("kind", ["point", "gaussian"])
def test_some_pixels_see_what_they_see_among_all(scene: str, kind: str, request: pytest.FixtureRequest) -> None:
    """An image costs as many pixels as are asked for, and each is the same."""
    frozen = request.getfixturevalue(scene)
    every = ViewedPixels.every(frozen, [frozen.view(CAMERA), frozen.view(CAMERA.resized(9, 9))])
    chosen = torch.arange(1, len(every.pixels), 3)
    some = ViewedPixels(frozen, every.views, chosen, every.operator.rows(chosen))
    models = [PixelModel.of(every, Effects()), PixelModel.of(every, Effects()).on(some)]
    whole, part = (model.columns(OwnLight(LIGHTS[kind])) for model in models)
    assert part.shape == (len(chosen), *whole.shape[1:])
    # Measured 0, and 8e-9 of the largest under a spot.
    torch.testing.assert_close(part, whole[chosen], rtol=0.0, atol=1e-6 * float(whole.abs().max()))
    assert [len(own) for own in some.own] == [65, 27]


def test_lights_of_a_rig_add_up_and_each_has_its_gradient(frozen: FrozenScene) -> None:
    rig = (LIGHTS["point"], LIGHTS["gaussian"], LIGHTS["led"])
    alone = sum(frozen.render(CAMERA, light) for light in rig)
    moving = [with_leaves(light) for light in rig]
    together = frozen.render(CAMERA, [light for light, _ in moving])
    # Measured 2e-7: sums in another order.
    torch.testing.assert_close(together.detach(), alone, rtol=1e-5, atol=1e-6)
    together.sum().backward()
    for light, leaves in moving:
        other, own = with_leaves(light.detached())
        frozen.render(CAMERA, other).sum().backward()
        for name, leaf in leaves.items():
            torch.testing.assert_close(leaf.grad, own[name].grad, rtol=1e-4, atol=1e-6)


def test_tensors_of_any_type_have_gradients_of_their_own_type(frozen: FrozenScene) -> None:
    position = torch.tensor(PLACE, requires_grad=True)
    intensity = torch.tensor(2.0, dtype=torch.float64, requires_grad=True)
    frozen.render(CAMERA, PointLight(position, intensity)).sum().backward()
    assert position.grad.dtype == torch.float32 and intensity.grad.dtype == torch.float64
    known = frozen.render(CAMERA, PointLight(position, intensity).detached())
    assert not known.requires_grad
    torch.testing.assert_close(intensity.grad, known.sum().double() / 2.0, rtol=1e-5, atol=0.0)


def test_without_cones_lights_shine_alike_and_without_lobes_a_scene_is_diffuse(
    frozen: FrozenScene, glossy: FrozenScene
) -> None:
    spot = LIGHTS["gaussian"]
    plain = frozen.render(CAMERA, spot, Effects(cones=False))
    assert torch.equal(plain, frozen.render(CAMERA, spot.plain))
    assert torch.equal(glossy.render(CAMERA, spot, Effects(lobes=False)), frozen.render(CAMERA, spot))
    lit, dark = (glossy.render(CAMERA, spot, Effects(shadows=on)) for on in (False, True))
    assert bool((lit >= dark - 1e-6).all()) and float(lit.sum()) > 1.05 * float(dark.sum())


def test_sharp_images_are_nearer_to_exact_ones_than_soft_ones() -> None:
    """Without bounces, of many small surfels on the same walls: what an image by large ones comes close to."""
    fine = FrozenScene.freeze(closed_box(1 / 60, 0.6), gather_rays=1, patches=1, seed=0)
    coarse = FrozenScene.freeze(closed_box(1 / 8, 0.6), gather_rays=1, patches=1, seed=0)
    light, direct = PointLight([0.1, 0.3, 0.2], 1.0), Effects(interreflection=False)
    truth = fine.render(CAMERA, light, direct)
    errors = [float((coarse.render(CAMERA, light, direct, sharp=on) - truth).square().mean()) for on in (True, False)]
    # Measured 9e-4.
    assert errors[0] < 0.01 * errors[1]


def test_a_camera_in_a_loop_is_traced_once(frozen: FrozenScene, monkeypatch: pytest.MonkeyPatch) -> None:
    traced = []

    def counted(bvh: object, camera: Camera) -> object:
        traced.append(camera)
        return build_view_weights(bvh, camera)

    monkeypatch.setattr("rgspipe.renderer.images.recent_views.build_view_weights", counted)
    scene = replace(frozen)
    cameras = [Camera.look_at([0.3, -0.4, 0.1 * k], [0, 0, 0], width=4, height=4) for k in range(KEPT + 1)]
    images = [scene.render(cameras[0], LIGHTS["point"]) for _ in range(3)]
    assert len(traced) == 1 and torch.equal(images[0], images[2])
    for camera in cameras:
        scene.render(camera, LIGHTS["point"])
    assert len(traced) == KEPT + 1
    scene.render(cameras[0], LIGHTS["point"])
    assert len(traced) == KEPT + 2, "those that were not looked through for longest are forgotten"


def test_the_dark_is_black(frozen: FrozenScene, glossy: FrozenScene) -> None:
    for scene in (frozen, glossy):
        for sharp in (True, False):
            assert not bool(scene.render(CAMERA, [], sharp=sharp).any())


def test_nothing_to_see_is_black_under_every_light(surfels: Surfels) -> None:
    nothing = {name: tensor[:0] for name, tensor in surfels.tensors().items()}
    empty = FrozenScene.freeze(replace(surfels, **nothing), gather_rays=4, patches=4)
    # It is told once, as the view is kept.
    with pytest.warns(UserWarning, match="The camera sees nothing"):
        assert not bool(empty.render(CAMERA, ()).any())
    for light in LIGHTS.values():
        moving, leaves = with_leaves(light)
        image = empty.render(CAMERA, moving)
        image.sum().backward()
        assert not bool(image.detach().any()) and not bool(leaves["position"].grad.any())
