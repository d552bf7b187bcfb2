"""What frames of a moving light tell of the next one."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from emitters import emitter_at
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import MotionOptions
from rgspipe.fitting.tracking.motion import Motion, offset, turns
from rgspipe.scene.lights import LedLight, Light, PointLight, SpotLight, SunLight

SHAPE = SpotLight.shaped("gaussian", math.radians(30.0), math.radians(12.0))


def _spot(place: tuple[float, ...], axis: tuple[float, ...], shape_free: bool = False) -> Emitter:
    direction = torch.nn.functional.normalize(torch.tensor(axis, dtype=torch.float64), dim=0)
    return emitter_at(torch.tensor(place, dtype=torch.float64), direction, SHAPE, shape_free=shape_free)


def _motion(*rig: Emitter, sd: float = 0.01, together: bool = False) -> Motion:
    count = sum(emitter.parameters + 3 for emitter in rig)
    information = torch.eye(count, dtype=torch.float64) / sd**2
    return Motion.starting(rig, 2.0 * torch.ones((len(rig), 3)).double(), information, 1.0, together)


def test_lights_go_on_at_their_rates_and_become_less_certain() -> None:
    motion = _motion(_spot((0.0, 0.1, 0.2), (0.0, 0.0, 1.0)))
    rates = torch.tensor([0.1, 0.0, -0.05, 0.2, 0.0], dtype=torch.float64)
    motion = replace(motion, rates=rates)
    ahead = motion.predicted()
    expected = torch.tensor([0.1, 0.1, 0.15], dtype=torch.float64)
    torch.testing.assert_close(ahead.rig[0].position, expected)
    assert math.acos(float(ahead.rig[0].axis @ motion.rig[0].axis)) == pytest.approx(0.2)
    assert ahead.position_errors()[0] > motion.position_errors()[0]
    # The turn goes on in the same plane, whichever tangents the axis has now.
    further = ahead.predicted()
    assert math.acos(float(further.rig[0].axis @ motion.rig[0].axis)) == pytest.approx(0.4, rel=0.02)


def test_an_update_is_that_of_a_kalman_filter() -> None:
    """A linear problem: the mean, the rate that follows from it, and the covariance have textbook values."""
    motion = replace(
        _motion(emitter_at(torch.zeros(3).double()), sd=0.05), rates=torch.tensor([0.1, 0.0, 0.0]).double()
    )
    ahead = motion.predicted()
    noise = 0.02
    measured = torch.tensor([0.16, 0.0, 0.0], dtype=torch.float64)
    covariance, seen = ahead.covariance, torch.zeros((3, len(ahead.covariance))).double()
    seen[:, :3] = torch.eye(3)
    gain = covariance @ seen.T @ torch.linalg.inv(seen @ covariance @ seen.T + noise**2 * torch.eye(3).double())
    change = gain @ (measured - ahead.rig[0].position)
    information = torch.zeros((6, 6), dtype=torch.float64)
    information[:3, :3] = torch.eye(3) / noise**2
    # The most likely lights of prediction and measurement together are what `follow` finds.
    found = emitter_at(ahead.rig[0].position + change[:3])
    intensity = ahead.intensity + (ahead.reference[:, None] * change[3:6])
    after = ahead.updated((found,), intensity, information)
    torch.testing.assert_close(after.rates, ahead.rates + change[6:])
    torch.testing.assert_close(after.covariance, covariance - gain @ seen @ covariance, rtol=1e-9, atol=1e-12)


def test_lights_of_one_carrier_change_their_rates_together() -> None:
    pair = (_spot((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), _spot((0.1, 0.0, 0.0), (0.0, 1.0, 0.2)))
    for together in (False, True):
        ahead = _motion(*pair, sd=1e-3, together=together).predicted().covariance
        apart = torch.zeros(len(ahead), dtype=torch.float64)
        # The difference of the two positions along y.
        apart[1], apart[6] = 1.0, -1.0
        spread = float(apart @ ahead @ apart) ** 0.5
        assert (spread < 0.4 * 0.1 * math.sqrt(2.0)) == together
        assert float(torch.linalg.eigvalsh(ahead).min()) > 0.0
    assert MotionOptions().rate_change[0] < 0.1


def test_an_offset_is_the_step_that_leads_there() -> None:
    start = _spot((0.1, 0.2, 0.3), (0.3, -0.5, 0.8), shape_free=True)
    step = torch.tensor([0.01, -0.02, 0.03, 0.02, -0.01, 0.03, -0.02], dtype=torch.float64)
    end = start.moved(step, 2.0)
    # Chords of the sphere and differences of cones are steps but for their squares.
    torch.testing.assert_close(offset((start,), (end,), 2.0), step, rtol=0.02, atol=1e-4)
    there_and_back = turns((end,), (start,)) @ turns((start,), (end,))
    torch.testing.assert_close(there_and_back, torch.eye(7).double(), rtol=0.0, atol=1e-3)


def test_covariances_are_those_of_natural_parameters() -> None:
    motion = _motion(_spot((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), sd=0.1)
    motion = replace(motion, size=3.0)
    (matrix,) = motion.light_covariances()
    assert matrix.shape == (9, 9)
    # 0.1 of a size of 3, 0.1 rad, and 0.1 of an intensity of 2; a broad prior takes off 0.5 %.
    expected = [0.3, 0.3, 0.3, 0.1, 0.1, 0.0, 0.2, 0.2, 0.2]
    assert matrix.diagonal().sqrt().tolist() == pytest.approx(expected, rel=0.01, abs=1e-9)


@pytest.mark.parametrize(
    ("light", "expected"),
    [
        (PointLight([0.0, 0.0, 0.0], 1.0), math.sqrt(3.0) * 0.01),
        (LedLight([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0], 1.0), math.sqrt(3.0) * 0.01),
        # Two angles; a sun has no place.
        (SunLight([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0]), math.sqrt(2.0) * 0.01),
    ],
    ids=lambda value: getattr(value, "kind", ""),
)
def test_errors_of_positions_are_not_made_of_intensities(light: Light, expected: float) -> None:
    """0.01 of the scene or 0.01 rad, beside intensities that are open by 30 %."""
    emitter = Emitter.of(light)
    # Parameters of both lights come before their intensities.
    deviations = torch.tensor([0.01] * (2 * emitter.parameters) + [0.3] * 6, dtype=torch.float64)
    information = torch.diag(deviations**-2)
    motion = Motion.starting((emitter, emitter), torch.ones((2, 3)).double(), information, 2.0)
    # Measured: 5e-5 less, by the broad prior of a first frame, and of the sun 5e-9 less, as the sphere's curve adds it.
    assert motion.position_errors() == pytest.approx([expected] * 2, rel=5e-4)
