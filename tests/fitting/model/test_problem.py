"""The unit image, its derivative, and the normal equations, against finite differences and plain algebra."""

from __future__ import annotations

import numpy as np
import torch

from emitters import emitter_at
from lit_room import HIDDEN, VISIBLE
from rgspipe.fitting.model.moments import moments
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.kernels.irradiance import SOFTENING


def _problem(room, point_light, where=VISIBLE, effects=None):
    images = room.images(point_light(where))
    return LightProblem.create(room.one.prepared, room.one.prepared.stack_images(images), effects)


def test_unit_image_is_the_renderer_s(room, point_light):
    light = point_light(VISIBLE)
    problem = _problem(room, point_light)
    image = problem.evaluate(emitter_at(light.position))[:, :, 0] * light.intensity.float() / problem.scale
    torch.testing.assert_close(image, problem.target, rtol=1e-5, atol=1e-6)


def test_derivative_matches_finite_differences(room, point_light):
    """Central differences over a step that is short enough not to cross a jump of the transmittance.

    It jumps where two hits part into two layers, which surfels that hang over edges do often, so longer steps
    differ by some percent; without shadows a step of 1e-3 agrees to 1e-4.
    """
    for where in (VISIBLE, HIDDEN):
        problem = _problem(room, point_light, where)
        position, step = torch.tensor(where, dtype=torch.float64) + 0.003, 1e-4
        slope = problem.evaluate(emitter_at(position))[:, :, 1:]
        for axis in range(3):
            offset = torch.zeros(3, dtype=torch.float64)
            offset[axis] = step
            upper, lower = (problem.evaluate(emitter_at(position + sign * offset))[:, :, 0] for sign in (1, -1))
            expected = (upper - lower) / (2 * step)
            error = float((slope[:, :, axis] - expected).norm() / expected.norm())
            assert error < 0.003, (where, axis, error)  # measured up to 2e-4


def test_effects_leave_parts_out(room, point_light):
    position = torch.tensor(HIDDEN, dtype=torch.float64)
    whole, direct, unshadowed = (
        _problem(room, point_light, effects=effects).evaluate(emitter_at(position))[:, :, 0].sum()
        for effects in (Effects(), Effects(interreflection=False), Effects(shadows=False))
    )
    assert direct < whole < unshadowed


def test_closed_form_intensity_is_exact():
    generator = torch.Generator().manual_seed(1)
    columns = torch.rand((40, 3, 4), generator=generator, dtype=torch.float64)
    weights = torch.rand((40, 3), generator=generator, dtype=torch.float64)
    target = torch.rand((40, 3), generator=generator, dtype=torch.float64)
    system = moments([columns], target, weights)
    for channel in range(3):
        root = weights[:, channel].sqrt()
        expected = torch.linalg.lstsq((root * columns[:, channel, 0])[:, None], (root * target[:, channel])[:, None])
        np.testing.assert_allclose(system.intensity[0, channel], expected.solution[0, 0], rtol=1e-12)
    residual = target - columns[:, :, 0] * system.intensity
    np.testing.assert_allclose(system.cost, (weights * residual.square()).sum(), rtol=1e-12)


def test_intensity_is_never_negative_and_dark_channels_are_zero():
    columns = torch.ones((10, 3, 4))
    columns[:, 2] = 0.0
    target = torch.ones((10, 3))
    target[:, 1] = -1.0
    system = moments([columns], target, torch.ones(10, 1))
    assert system.intensity.tolist() == [[1.0, 0.0, 0.0]]
    assert np.isfinite(system.cost) and torch.isfinite(system.parameter_system()[0]).all()
    assert torch.isfinite(system.information(system.intensity)).all()


def test_projected_system_is_the_schur_complement_of_the_joint_one(room, point_light):
    """Eliminating the intensity gives the same matrix as solving for position and intensity together."""
    problem = _problem(room, point_light)
    columns = problem.evaluate(emitter_at(torch.tensor(VISIBLE, dtype=torch.float64) + 0.02))
    system = problem.moments([columns], problem.relative_weights().square())
    joint, count = system.information(system.intensity), 3
    corner, side, rest = joint[:count, :count], joint[:count, count:], joint[count:, count:]
    expected = corner - side @ torch.linalg.solve(rest, side.T)
    torch.testing.assert_close(system.parameter_system()[0], expected, rtol=1e-9, atol=1e-9)


def test_a_light_on_a_surfel_is_finite(room, point_light):
    """Exactly on a surfel, on its back, at its edge and far outside: finite values and derivatives."""
    problem = _problem(room, point_light)
    surfels = room.frozen.surfels
    spots = [surfels.centers[k] + shift * surfels.normals[k] for k in (0, 500, 1200) for shift in (0.0, 1e-6, -0.01)]
    for position in [*spots, torch.tensor([50.0, 0.0, 0.0]), torch.tensor([1e6, 1e6, 1e6])]:
        columns = problem.evaluate(emitter_at(position.double()))
        assert torch.isfinite(columns).all()
        assert torch.isfinite(problem.moments([columns], problem.relative_weights()).values).all()


def test_unit_irradiance_on_a_surfel_is_bounded_by_the_softening(room):
    surfels = room.frozen.surfels
    softening = float(SOFTENING) * float(surfels.scales[0].prod().sqrt())
    irradiance, slope = unit_irradiance(room.frozen.bvh, surfels.centers[:1])
    assert float(irradiance.max()) <= 1.0 / softening**2 and float(slope.abs().max()) <= 4.0 / softening**3
