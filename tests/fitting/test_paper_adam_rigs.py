"""The paper's method on several lights and on spots: its image and gradients, and that it finds them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from torch import Tensor

import double_precision
from double_precision import DoubleTransport
from emitters import emitter_at
from hard_cases import camera
from hard_cases import room as small_room
from lit_room import VISIBLE
from rgspipe.fitting import LightSpec, PaperAdam
from rgspipe.fitting.baselines.paper_adam_loss import AdamLoss, MovingRig, rig_image
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import prepare_views
from rgspipe.fitting.search_lm import fit_from
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.zonal_harmonics import BandLimit, legendre, zonal_coefficients
from rgspipe.scene import SpotLight
from rgspipe.scene.lights.angles import angle_from_axis

SHAPE = SpotLight.shaped("gaussian", math.radians(25.0), math.radians(12.0))
SPOTS = LightSpec("spot", shape=SHAPE)


def unit(*vector: float) -> Tensor:
    return torch.nn.functional.normalize(torch.tensor(vector, dtype=torch.float64), dim=0)


def two_spots() -> tuple[Tensor, Tensor, Tensor]:
    """Positions, log-intensities and axes (2, 3), all leaves."""
    positions = torch.tensor([[0.05, -0.1, 0.15], [-0.2, 0.2, 0.3]], dtype=torch.float64)
    strengths = torch.tensor([[0.1, 0.4, -0.3], [-0.2, 0.3, 0.0]], dtype=torch.float64)
    axes = torch.stack([unit(0.5, -0.3, -0.8), unit(-0.2, 0.7, -0.6)])
    return tuple(leaf.requires_grad_() for leaf in (positions, strengths, axes))


def intensity_in_double(points: Tensor, position: Tensor, axis: Tensor, band: BandLimit | None) -> Tensor:
    angle = angle_from_axis(axis, points - position)
    if band is None:
        return SHAPE.relative_intensity_at(angle)
    return legendre(torch.cos(angle), band.degree)[0] @ zonal_coefficients(SHAPE, band)[0]


@pytest.mark.parametrize("band", [None, BandLimit(6), BandLimit(9, mirrored=False)])
def test_loss_and_gradients_of_two_spots_are_those_of_float64(band: BandLimit | None) -> None:
    surfels = small_room()
    frozen = FrozenScene.freeze(surfels, gather_rays=16, patches=20, seed=0)
    views = prepare_views(frozen, [frozen.view(camera())], mask_edges=False)
    target = torch.full((views.every_pixel.operator.shape[0], 3), 0.2)
    shape = (views.views[0].camera.height, views.views[0].camera.width)
    transport, operator = DoubleTransport.of(frozen), views.every_pixel.operator.matrix.to_dense().double()
    double = double_precision.in_double(surfels)
    results = []
    for exact in (False, True):
        leaves = two_spots()
        if exact:
            image = 0.0
            for position, strength, axis in zip(*leaves, strict=True):
                relative = intensity_in_double(double.centers, position, axis, band)
                lit = relative * double_precision.irradiance(double, position)
                image = image + (operator @ transport.radiance(lit[:, None])[:, :, 0]) * strength.exp()
            loss = double_precision.adam_loss(image, target.double(), [shape], list(views.masks), 0.2)
        else:
            positions, strengths, axes = leaves
            rig = MovingRig(positions, strengths, SHAPE, axes)
            loss = AdamLoss(views, target, 0.2, Effects(spots=band))(rig)
        loss.backward()
        results.append((loss.detach()[None], *(leaf.grad for leaf in leaves)))
    # The exact profile's derivative towards an axis of unit length has no part along it.
    for index, (single, double_) in enumerate(zip(*results, strict=True)):
        if index == 3:
            axes = two_spots()[2].detach()
            double_ = double_ - (double_ * axes).sum(dim=1, keepdim=True) * axes
        assert float((single.double() - double_).abs().max()) < 1e-5 * float(double_.abs().max())  # measured 1.3e-6


def test_the_image_of_a_rig_is_the_scene_s(room, point_light) -> None:
    """Exact spots, all bounces, several lights at once: as every other stage renders them."""
    positions, strengths, axes = (leaf.detach() for leaf in two_spots())
    rig = MovingRig(positions, strengths, SHAPE, axes)
    found = rig_image(room.one.prepared, rig, Effects())
    expected = room.frozen.render(room.views[0], rig.lights(), sharp=False).reshape(-1, 3)
    torch.testing.assert_close(found, expected, atol=1e-6, rtol=1e-5)  # measured 0


def test_adam_finds_two_points(room, point_light) -> None:
    rig = (point_light(VISIBLE), point_light((-0.25, 0.3, 0.2), (2.0, 0.5, 1.0)))
    images = [room.frozen.render(view, rig, sharp=False) for view in room.views]
    starts = [point_light(VISIBLE, (1.0, 1.0, 1.0)), point_light((-0.25, 0.3, 0.2), (1.0, 1.0, 1.0))]
    solver = PaperAdam(epochs=1, steps=80, intensity_rate=0.1, training_lights=starts, seed=1)
    result = replace(room.two, lights=LightSpec(count=2)).fit(images, solver=solver)
    distances = [min(float((found.position - true.position).norm()) for found in result.lights) for true in rig]
    # Measured 0.018 and 0.006.
    assert result.loss < 0.1 * result.trajectory[0].loss and max(distances) < 0.03
    assert len(result.lights) == len(result.covariance) == result.lights_tried == 2


def test_adam_finds_a_spot_and_its_axis(room, point_light) -> None:
    axis = unit(-0.3, 0.5, -0.6)
    light = point_light(VISIBLE)
    truth = SHAPE.at(light.position, axis, light.intensity)
    images = [room.frozen.render(view, (truth,), sharp=False) for view in room.views]
    start = point_light((0.05, -0.2, 0.2), (1.0, 1.0, 1.0))
    solver = PaperAdam(epochs=1, steps=60, intensity_rate=0.1, axis_rate=0.02, training_lights=[start])
    result = replace(room.two, lights=SPOTS).fit(images, solver=solver)
    (found,), (first,) = result.lights, result.trajectory[0].lights
    # Measured 0.010 and 0.026.
    assert float((found.direction - axis).norm()) < 0.1 * float((first.direction - axis).norm())
    assert float((found.position - light.position).norm()) < 0.2 * float((first.position - light.position).norm())
    assert result.covariance[0].shape == (9, 9) and torch.isfinite(result.covariance[0]).all()


def test_the_same_seed_gives_the_same_rig_and_axes_stay_of_unit_length(room, point_light) -> None:
    wild = PaperAdam(epochs=1, steps=6, axis_rate=3.0, position_rate=3.0, init="sphere", aim="random")
    views = replace(room.one, lights=LightSpec("spot", 2, SHAPE))
    image = room.images(point_light(VISIBLE))
    one, same, other = (views.fit(image, solver=replace(wild, seed=seed)) for seed in (5, 5, 6))
    for index in range(2):
        assert torch.equal(one.lights[index].position, same.lights[index].position)
        assert torch.equal(one.lights[index].direction, same.lights[index].direction)
        assert not torch.equal(one.lights[index].position, other.lights[index].position)
    for step in one.trajectory:
        assert math.isfinite(step.loss)
        for light in step.lights:
            assert float(light.direction.norm()) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    "spec", [LightSpec("auto"), LightSpec(count=None), LightSpec("spot", shape=SHAPE, shape_free=True)]
)
def test_what_is_not_known_is_refused(room, point_light, spec: LightSpec) -> None:
    with pytest.raises(ValueError, match="known"):
        replace(room.one, lights=spec).fit(room.images(point_light(VISIBLE)), solver=PaperAdam())


def test_a_hard_edge_has_a_gradient(room, point_light) -> None:
    """It is taken with the least rim of fits; a derivative of zero would never turn the axis."""
    hard = SpotLight.shaped("smoothstep", math.radians(30.0), 0.0)
    positions, strengths, axes = (leaf[:1].detach().requires_grad_() for leaf in two_spots())
    target = torch.zeros((room.one.prepared.every_pixel.operator.shape[0], 3))
    AdamLoss(room.one.prepared, target, 0.2, Effects())(MovingRig(positions, strengths, hard, axes)).backward()
    assert float(axes.grad.norm()) > 0.0 and torch.isfinite(axes.grad).all()


def test_least_squares_finds_a_spot_in_the_images_of_its_harmonics(room, point_light) -> None:
    """The image and every derivative of the other methods' model are band-limited, too."""
    axis, light = unit(-0.3, 0.5, -0.6), point_light(VISIBLE)
    rig = MovingRig(light.position[None], light.intensity[None].log(), SHAPE, axis[None])
    start = emitter_at(light.position + 0.05, unit(-0.4, 0.4, -0.6), SHAPE)
    images = rig_image(room.two.prepared, rig, Effects(spots=BandLimit(6)))
    banded, exact = (
        fit_from(LightProblem.create(room.two.prepared, images, Effects(spots=band)), [start])
        for band in (BandLimit(6), None)
    )
    errors = [float((result.lights[0].position - light.position).norm()) for result in (banded, exact)]
    # Measured 2e-8, 0.11, and 4e-8 for the axis.
    assert errors[0] < 1e-5 and errors[1] > 0.01
    assert float((banded.lights[0].direction - axis).norm()) < 1e-5
