"""Scenes with gloss: against an exact path tracer and a slow reference with the exact lobe, energy, and derivatives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from phong_room import PhongRoom
from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.gather import cosine_directions
from rgspipe.renderer.glossy import mirrored, phong_lobe
from rgspipe.renderer.glossy_transport import GlossyTransport, build_glossy_transport
from rgspipe.renderer.rig import RigResponse, stacked
from rgspipe.renderer.spherical_harmonics import real_harmonics
from rgspipe.renderer.transport import build_patch_transport, with_bounces
from rgspipe.scene import Camera, Gloss, LightRig, PointLight, SpotLight, Surfels, look_at
from rooms import closed_box, sphere, surfels_on

#: Light that meets one surface.
DIRECT = Effects(interreflection=False)

LIGHT, EYE = (0.1, -0.2, 0.1), (-0.3, 0.25, 0.2)


def glossy_box(cells: int, specular: float, exponent: float, albedo: float = 0.5, everywhere: bool = False) -> Surfels:
    """The inside of a unit cube whose floor, or all of which, is glossy."""
    box = closed_box(1.0 / cells, albedo)
    chosen = (box.centers[:, 2] < -0.49) | everywhere
    reflectance = specular * chosen.double()[:, None].expand(-1, 3)
    return replace(box, gloss=Gloss(reflectance.clone(), torch.full((len(box),), exponent, dtype=torch.float64)))


def frozen(surfels: Surfels, rays: int = 256, patches: int = 200) -> FrozenScene:
    return FrozenScene.freeze(surfels, gather_rays=rays, patches=patches, seed=0)


@pytest.fixture(scope="module")
def room() -> FrozenScene:
    """1536 surfels; a floor of k_s = 0.4 and n = 20 that holds 256 of them."""
    return frozen(glossy_box(16, 0.4, 20.0))


def lamp(position: tuple[float, float, float] = LIGHT, intensity: float = 1.0) -> PointLight:
    return PointLight(torch.tensor(position), torch.full((3,), intensity))


def view_of(scene: FrozenScene, resolution: int = 16):
    pose = look_at(torch.tensor(EYE), torch.tensor([0.1, -0.1, -0.5]))
    return scene.view(Camera.from_field_of_view(pose, 1.2, resolution, resolution))


@pytest.mark.parametrize(("exponent", "largest"), [(5.0, 0.04), (20.0, 0.06), (100.0, 0.12)])
def test_radiance_of_a_glossy_room_is_that_of_an_exact_path_tracer(
    room: FrozenScene, exponent: float, largest: float
) -> None:
    """All bounces, between walls and floor and back, on the floor and on the walls."""
    gloss = Gloss(room.surfels.gloss.reflectance, torch.full((len(room.surfels),), exponent))
    surfels = replace(room.surfels, gloss=gloss)
    scene = replace(room, surfels=surfels, gloss=build_glossy_transport(surfels, room.gather, room.transport))
    floor = room.gloss.glossy[torch.tensor([40, 100, 120, 136, 180, 210])]
    points = torch.cat([floor, torch.tensor([300, 500, 700, 900, 1100, 1300])])
    truth = PhongRoom(0.5, 0.4, exponent, np.array(LIGHT))
    places = surfels.centers[points].double().numpy()
    expected, deviation = truth.radiance(places, np.array(EYE), paths=8000, bounces=12)
    found = scene.glossy_light((lamp(),)).seen_from(torch.tensor(EYE))[points, 0].double().numpy()
    error = np.abs(found / expected - 1.0)
    # Measured 2.1, 4.1 and 9.2 % at most, 1.0, 1.2 and 2.5 % on average, of which the path tracer's noise is up to 0.5,
    # 1.1 and 2.6 %. Patches and gather rays take 1 % of a diffuse room already.
    assert float(error.max()) < largest
    assert float(error.mean()) < 0.4 * largest
    assert float((deviation / expected).max()) < 0.25 * largest


def test_the_highlight_of_a_light_is_the_exact_lobe(room: FrozenScene) -> None:
    """Direct light alone: no harmonic is in it, so it has no band limit."""
    found = room.glossy_light((lamp(),), DIRECT).seen_from(torch.tensor(EYE)).double()
    truth = PhongRoom(0.5, 0.4, 20.0, np.array(LIGHT))
    expected, _ = truth.radiance(room.surfels.centers.double().numpy(), np.array(EYE), paths=1, bounces=0)
    # Measured 2e-5, next to the light's own softening.
    torch.testing.assert_close(found, torch.from_numpy(expected)[:, None].expand(-1, 3), rtol=2e-4, atol=1e-6)


def exact_bounce(surfels: Surfels, shares: Tensor, light: Tensor, eye: Tensor) -> Tensor:
    """(N,) radiance towards `eye` of direct light and one more bounce; exact lobes, every pair of surfels, float64.

    Args:
        shares: (N, N) gather operator.
        light: (3,) an unshadowed light of intensity 1.
    """
    centers, normals = surfels.centers, surfels.normals
    specular, exponents = surfels.gloss.reflectance[:, 0], surfels.gloss.exponents
    unit = torch.nn.functional.normalize
    to_light, to_eye = unit(light - centers, dim=1), unit(eye - centers, dim=1)
    irradiance = (to_light * normals).sum(-1).clamp(min=0.0) / (light - centers).square().sum(-1)
    towards = unit(centers[None] - centers[:, None], dim=-1)  # [i, j] from i to j

    def lobe(arriving: Tensor, leaving: Tensor, at: Tensor) -> Tensor:
        return specular[at] * phong_lobe((mirrored(arriving, normals[at]) * leaving).sum(-1), exponents[at])

    every = torch.arange(len(centers))
    diffuse = surfels.albedo[:, 0] / math.pi * irradiance
    sent = diffuse + lobe(to_light, -towards, every.expand(len(every), -1)) * irradiance  # [i, j]: what j sends to i
    seen = (shares * sent).sum(dim=1) * surfels.albedo[:, 0]
    mirror = lobe(towards, to_eye[:, None].expand_as(towards), every[:, None].expand(-1, len(every)))
    highlight = lobe(to_light, to_eye, every) * irradiance
    return diffuse + highlight + seen + math.pi * (shares * sent * mirror).sum(dim=1)


@pytest.mark.parametrize(("degree", "tolerance"), [(4, 4e-3), (6, 4e-4), (8, 1e-4)])
def test_one_bounce_converges_to_the_exact_lobe_with_the_degree(degree: int, tolerance: float) -> None:
    """In a box that is glossy all over, with a patch for each surfel: light to, between and from glossy surfels."""
    surfels = glossy_box(6, 0.4, 4.0, everywhere=True)
    scene = frozen(surfels, rays=64, patches=10)
    own = np.random.default_rng(0).permutation(len(surfels))
    transport = build_patch_transport(scene.gather, own, scene.areas, scene.surfels.albedo, bounces=1)
    gloss = build_glossy_transport(scene.surfels, scene.gather, transport, degree)
    light, eye = (torch.tensor(x, dtype=torch.float64) for x in (LIGHT, EYE))
    expected = exact_bounce(surfels, torch.from_numpy(scene.gather.to_scipy().toarray()).double(), light, eye)
    exact = unshadowed(surfels, (lamp(),))
    response = RigResponse(exact.lights, exact.irradiance.float(), (exact.slopes[0].float(),))
    found = gloss.light(transport, response).seen_from(eye)[:, 0].double()
    # Measured 2.0e-3, 1.8e-4 and 5.1e-5.
    assert float((found - expected).norm() / expected.norm()) < tolerance


def unshadowed(surfels: Surfels, lights: LightRig) -> RigResponse:
    """Irradiance n·d/|d|³ of point lights of unit intensity and its derivative, in float64."""
    d = stacked(lights, "position").detach()[:, None] - surfels.centers
    inverse, facing = d.square().sum(-1).rsqrt(), (d * surfels.normals).sum(-1)
    slope = surfels.normals * inverse.pow(3)[..., None] - 3.0 * d * (facing * inverse.pow(5))[..., None]
    lit = facing > 0.0
    slopes = torch.where(lit[..., None], slope, 0.0)
    return RigResponse(lights, facing.clamp(min=0.0) * inverse.pow(3), tuple(slopes))


def point_lights(positions: Tensor, intensities: Tensor) -> LightRig:
    return tuple(PointLight(*each) for each in zip(positions, intensities, strict=True))


def test_gloss_without_reflectance_is_exactly_the_diffuse_scene(room: FrozenScene) -> None:
    diffuse = replace(room.surfels, gloss=None)
    black = replace(room.surfels, gloss=Gloss(torch.zeros(len(diffuse), 3), torch.full((len(diffuse),), 20.0)))
    scenes = [frozen(surfels, rays=16) for surfels in (diffuse, black)]
    images = [scene.render(view_of(scene), (lamp(),), sharp=False) for scene in scenes]
    assert scenes[0].gloss is None
    assert scenes[1].gloss is None
    assert torch.equal(*images)


def test_a_diffuse_scene_touches_nothing_of_gloss(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is never called costs nothing."""

    def never(*_: object, **__: object) -> None:
        raise AssertionError("gloss in a diffuse scene")

    for name in ("light", "spread", "highlights", "directions"):
        monkeypatch.setattr(GlossyTransport, name, never)
    monkeypatch.setattr("rgspipe.renderer.glossy_transport.build_glossy_operators", never)
    scene = frozen(closed_box(1 / 4), rays=16, patches=20)
    assert torch.isfinite(scene.render(view_of(scene), (lamp(),), sharp=False)).all()
    with pytest.raises(ValueError, match="use radiance_of"):
        scene.glossy_light((lamp(),))


def test_a_surfel_in_uniform_light_reflects_the_visible_share_of_its_lobe(room: FrozenScene) -> None:
    """L = 1 all around: the specular part towards ω is k_s ∫ p_n(ω mirrored · ω') cos θ' dω'."""
    gloss, count = room.gloss, len(room.surfels)
    transport = with_bounces(room.transport, 1)
    _, reflected = gloss.spread(transport, torch.ones(count, 3, 1), torch.zeros(len(gloss.glossy), 25, 3, 1))
    generator = torch.Generator().manual_seed(0)
    axes = room.surfels.frames[gloss.glossy[:1]].double()  # one for the whole floor
    around = cosine_directions(axes, 200_000, generator)[0]
    eyes = cosine_directions(axes, 20, generator)[0]
    mirror = mirrored(eyes, axes[0, 2])
    share = math.pi * phong_lobe(mirror @ around.T, torch.tensor(20.0).double()).mean(dim=1)
    found = torch.einsum("rk,gk->gr", real_harmonics(eyes, 4), reflected[:, :, 0, 0].double()) / 0.4
    error = (found - share)[(room.surfels.centers[gloss.glossy, :2].abs() < 0.3).all(dim=1)]
    # Shares are 0.2 to 1. Away from the walls measured 0.010 in the mean, and 0.022 of single surfels: the noise of 256
    # rays. Beside a wall it is 0.1, as the direction of the nearest surfel is that of its centre.
    assert float(error.mean(dim=0).abs().max()) < 0.015
    assert float(error.square().mean().sqrt()) < 0.03


@pytest.mark.parametrize("exponent", [1.0, 10.0, 100.0])
def test_gloss_never_makes_energy(exponent: float) -> None:
    """Power that leaves as gloss is at most k_s times the power that arrives, whatever light falls on the surfels."""
    scene = frozen(glossy_box(8, 0.5, exponent, everywhere=True))
    transport, generator = with_bounces(scene.transport, 1), torch.Generator().manual_seed(0)
    labels = torch.from_numpy(transport.average.to_scipy().tocsc().indices).long()
    source = torch.rand(len(labels), 1, generator=generator).pow(8.0)[labels].expand(-1, 3)
    _, reflected = scene.gloss.spread(transport, source[..., None], torch.zeros(len(labels), 25, 3, 1))
    arriving = math.pi * (scene.gather @ source)[:, 0]
    around = cosine_directions(scene.surfels.frames, 1000, generator)
    leaving = math.pi * torch.einsum("nrk,nk->n", real_harmonics(around, 4), reflected[:, :, 0, 0]) / 1000
    share = leaving / arriving
    # Measured 0.43, 0.42 and 0.42 at most, 0.37, 0.34 and 0.34 on average: of slanted light the lobe loses a part.
    assert 0.3 < float(share.mean()) < float(share.max()) < 0.5


def test_lights_add_up_and_scale(room: FrozenScene) -> None:
    a, b = (
        lamp(),
        SpotLight(
            torch.tensor([-0.2, 0.1, 0.3]),
            torch.tensor([1.0, 2.0, 0.5]),
            torch.tensor([0.3, 0.0, -1.0]),
            "gaussian",
            0.4,
            0.2,
        ),
    )
    eye = torch.tensor(EYE)
    one, other, both = (room.glossy_light(rig).seen_from(eye) for rig in ((a,), (b,), (a, b)))
    # Measured 7e-7; bounces end when the next one is below 1e-4 of the direct light, which may differ by one bounce.
    torch.testing.assert_close(both, one + other, rtol=1e-3, atol=1e-5)
    twice = room.glossy_light((lamp(intensity=2.0),)).seen_from(eye)
    torch.testing.assert_close(twice, 2.0 * one, rtol=1e-5, atol=1e-6)


def test_counted_bounces_lead_to_all_of_them(room: FrozenScene) -> None:
    eye, rig = torch.tensor(EYE), (lamp(),)
    everything = room.glossy_light(rig).seen_from(eye)
    counted = [room.with_solver("patches", bounces=b).glossy_light(rig).seen_from(eye) for b in (0, 2, 16)]
    assert torch.equal(counted[0], room.glossy_light(rig, DIRECT).seen_from(eye))
    errors = [float((image - everything).norm() / everything.norm()) for image in counted]
    # Measured 0.51, 0.15 and 1.1e-4.
    assert errors[0] > errors[1] > 1e-2 > 1e-3 > errors[2]


def test_other_solvers_refuse_gloss(room: FrozenScene) -> None:
    for solver in ("gather", "monte_carlo"):
        with pytest.raises(ValueError, match="this scene has gloss"):
            room.with_solver(solver)


def test_derivatives_towards_the_light_are_those_of_finite_differences() -> None:
    """Through irradiance, mirrored direction and lobe, in float64; of highlights and of their harmonics."""
    surfels = glossy_box(6, 0.4, 12.0, everywhere=True)
    scene = frozen(surfels, rays=16, patches=20)
    gloss = GlossyTransport(surfels, scene.gloss.glossy, scene.gloss.operators)
    weights = torch.rand(len(surfels), 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)

    def seen(lights: Tensor, intensities: Tensor, eye: Tensor) -> Tensor:
        light = gloss.light(scene.transport, unshadowed(surfels, point_lights(lights, intensities)), False)
        return (light.seen_from(eye) * weights).sum()

    def harmonics(lights: Tensor) -> Tensor:
        rig = point_lights(lights, torch.ones_like(lights))
        light = gloss.light(scene.transport, unshadowed(surfels, rig), False)
        return gloss.highlights(light.towards, light.irradiance)[..., :20, :, 0].sum()

    lights = torch.tensor([LIGHT, (-0.2, 0.1, 0.3)], dtype=torch.float64, requires_grad=True)
    intensities = torch.tensor([[1.0, 2.0, 0.5], [0.3, 0.2, 1.0]], dtype=torch.float64, requires_grad=True)
    eye = torch.tensor(EYE, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(seen, (lights, intensities, eye), eps=1e-6, rtol=1e-6)
    assert torch.autograd.gradcheck(harmonics, (lights,), eps=1e-6, rtol=1e-6)


def test_derivative_of_the_whole_image_is_that_of_finite_differences(room: FrozenScene) -> None:
    """Through all bounces, in float32; a closed box has no shadow whose edge could matter."""
    view = view_of(room)
    weights = torch.rand(16, 16, 3, generator=torch.Generator().manual_seed(0))

    def loss(position: Tensor) -> Tensor:
        return (room.render(view, (PointLight(position, torch.ones(3)),), sharp=False) * weights).double().sum()

    position = torch.tensor(LIGHT, requires_grad=True)
    loss(position).backward()
    step = 2e-3
    for axis in range(3):
        shift = step * torch.eye(3)[axis]
        with torch.no_grad():
            expected = (loss(position + shift) - loss(position - shift)) / (2.0 * step)
        # Measured 4e-5.
        assert float(position.grad[axis]) == pytest.approx(float(expected), rel=1e-3)


@pytest.mark.parametrize("height", [0.0, 1e-6, 0.05, -1e-6])
def test_a_light_and_an_eye_on_a_glossy_surfel_leave_everything_finite(room: FrozenScene, height: float) -> None:
    center = room.surfels.centers[room.gloss.glossy[100]]
    place = center + torch.tensor([0.0, 0.0, height])
    position, intensity = place.clone().requires_grad_(), torch.ones(3, requires_grad=True)
    eye = place.clone().requires_grad_()
    radiance = room.glossy_light((PointLight(position, intensity),)).seen_from(eye)
    radiance.sum().backward()
    assert torch.isfinite(radiance).all()
    for leaf in (position, intensity, eye):
        assert torch.isfinite(leaf.grad).all()


def test_gloss_that_makes_energy_and_harmonics_of_no_degree_are_refused(room: FrozenScene) -> None:
    too_much = replace(room.surfels, gloss=Gloss(room.surfels.gloss.reflectance + 0.2, room.surfels.gloss.exponents))
    with pytest.raises(ValueError, match=r"at most 1, got 1\.1"):
        build_glossy_transport(too_much, room.gather, room.transport)
    with pytest.raises(ValueError, match="degree 1 or more, got 0"):
        build_glossy_transport(room.surfels, room.gather, room.transport, degree=0)


def test_a_glossy_object_that_sees_nothing_has_highlights_alone() -> None:
    """The outside of a ball: no surfel sees another, and the gather operator is empty."""
    ball = sphere(2600)
    outside = surfels_on(ball.centers, -ball.normals, math.sqrt(4.0 * math.pi / 2600))
    count = len(outside)
    gloss = Gloss(torch.full((count, 3), 0.3), torch.full((count,), 30.0)).to(torch.float64)
    scene = frozen(replace(outside, gloss=gloss), rays=16, patches=20)
    assert scene.gather.entries == 0
    light, eye = lamp((3.0, 1.0, 2.0)), torch.tensor([2.5, -2.0, 1.0])
    everything, direct = (scene.glossy_light((light,), effects).seen_from(eye) for effects in (ALL_EFFECTS, DIRECT))
    assert torch.equal(everything, direct)
    assert float(everything.amax()) > 3.0 * float(scene.radiance_of((light,)).amax())
