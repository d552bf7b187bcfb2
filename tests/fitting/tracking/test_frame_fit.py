"""A frame's images and the motion before it, weighed against each other."""

from __future__ import annotations

from dataclasses import replace

import torch

from emitters import emitter_at
from lit_room import VISIBLE
from rgspipe.fitting import FitStatus
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.tracking.frame_fit import follow, observed
from rgspipe.fitting.tracking.motion import Motion

WRONG = torch.tensor([0.03, -0.02, 0.02], dtype=torch.float64)


def _problem(room, light, noise: float = 0.0) -> LightProblem:
    generator = torch.Generator().manual_seed(0)
    images = room.images(light, 2)
    images = [image * (1.0 + noise * torch.randn(image.shape, generator=generator)) for image in images]
    stacked = room.two.prepared.stack_images(images)
    return LightProblem.create(room.two.prepared, stacked, room.two.effects)


def _predicted(light, size: float, position_sd: float, intensity_sd: float = 0.05) -> Motion:
    """The light at WRONG from where it is, and 10 % too bright."""
    variances = torch.tensor([position_sd] * 3 + [intensity_sd] * 3 + [0.1] * 3, dtype=torch.float64).square()
    rig = (emitter_at(light.position + WRONG),)
    intensity = 1.1 * light.intensity[None]
    return Motion(rig, intensity, intensity.mean(dim=1), torch.zeros(3).double(), torch.diag(variances), size)


def test_images_without_noise_outweigh_the_motion(room, point_light) -> None:
    light = point_light(VISIBLE)
    problem = _problem(room, light)
    made = follow(problem, _predicted(light, problem.views.frozen.size, 0.1), 1.0, 30)
    # Measured: 3e-6 and 1e-5.
    assert float((made.motion.rig[0].position - light.position).norm()) < 1e-4
    torch.testing.assert_close(made.result.lights[0].intensity, light.intensity, rtol=1e-3, atol=0.0)
    assert made.result.status == FitStatus.CONVERGED and made.motion.position_errors()[0] < 1e-3


def test_a_sure_motion_outweighs_images_that_tell_little(room, point_light) -> None:
    light = point_light(VISIBLE)
    problem = _problem(room, light, noise=0.3)
    predicted = _predicted(light, problem.views.frozen.size, 1e-5, 1e-5)
    made = follow(problem, predicted, 100.0, 30)
    assert float((made.motion.rig[0].position - predicted.rig[0].position).norm()) < 1e-4
    torch.testing.assert_close(made.motion.intensity, predicted.intensity, rtol=1e-3, atol=0.0)
    assert made.motion.position_errors()[0] < 1e-4


def test_in_between_the_answer_is_the_most_likely_one(room, point_light) -> None:
    """No step from it lowers Σ r² / 2f²σ² + dᵀC⁻¹d / 2, worked out here from images alone."""
    light = point_light(VISIBLE)
    problem = _problem(room, light, noise=0.3)
    predicted, inflation = _predicted(light, problem.views.frozen.size, 0.01), 8.0
    made = follow(problem, predicted, inflation, 60)
    size = problem.views.frozen.size
    # Neither where it was predicted nor where the images alone would have it.
    shares = (made.motion.rig[0].position - light.position).norm() / WRONG.norm()
    assert 0.05 < float(shares) < 0.95

    def squares(position: torch.Tensor, intensity: torch.Tensor) -> float:
        column = problem.evaluate(emitter_at(position))
        return float(problem.residual([column], intensity / problem.scale).double().square().sum())

    variance = squares(made.motion.rig[0].position, made.motion.intensity) / problem.target.numel()

    def cost(step: torch.Tensor) -> float:
        position = made.motion.rig[0].position + size * step[:3]
        intensity = made.motion.intensity + predicted.reference[:, None] * step[None, 3:]
        away = torch.cat(
            [
                (position - predicted.rig[0].position) / size,
                ((intensity - predicted.intensity) / predicted.reference[:, None])[0],
            ]
        )
        prior = float((away.square() / predicted.covariance.diagonal()[:6]).sum())
        return 0.5 * squares(position, intensity) / (variance * inflation**2) + 0.5 * prior

    least = cost(torch.zeros(6).double())
    for index in range(6):
        # Half a standard deviation of what is known after the frame costs 1/8.
        step = torch.zeros(6, dtype=torch.float64)
        step[index] = 0.5 * float(made.motion.covariance[index, index].sqrt())
        # Measured: 0.12 to 0.4 (a step along one unknown leaves the others where they are).
        assert cost(step) > least + 0.05 and cost(-step) > least + 0.05


def test_a_searched_frame_starts_a_motion_at_rest(room, point_light) -> None:
    light = point_light(VISIBLE)
    problem = _problem(room, light, noise=0.05)
    made = observed(problem, (emitter_at(light.position),))
    assert float(made.motion.rates.abs().max()) == 0.0
    torch.testing.assert_close(made.motion.intensity[0], light.intensity, rtol=0.02, atol=0.0)
    # 5 % of noise in 4400 pixels: measured 2e-4.
    assert 1e-5 < made.motion.position_errors()[0] < 5e-3


def test_a_released_motion_only_says_where_to_start(room, point_light) -> None:
    """A lamp that was dimmed to a third: far from what a motion expects, and found at once without it."""
    light = point_light(VISIBLE)
    problem = _problem(room, replace(light, intensity=light.intensity / 3.0))
    predicted = _predicted(light, problem.views.frozen.size, 0.02)
    made = follow(problem, predicted.released(), 100.0, 30)
    torch.testing.assert_close(made.motion.intensity[0], light.intensity / 3.0, rtol=1e-2, atol=0.0)
