"""Fixed points from a few iterates."""

from __future__ import annotations

import torch

from rgspipe.training.mixing import Mixing


def test_mixing_solves_a_linear_fixed_point_sooner_than_damping() -> None:
    """x = b − a x with slopes up to 1.5, where undamped steps diverge."""
    slope = torch.linspace(0.2, 1.5, 50)[:, None].repeat(1, 3)
    truth = 1.0 / (1.0 + slope)
    mixed, damped, mixing = torch.zeros(50, 3), torch.zeros(50, 3), Mixing(0.45)
    for _ in range(5):
        mixed = mixing.next(mixed, 1.0 - slope * mixed)
        damped = damped + 0.45 * (1.0 - slope * damped - damped)
    errors = [float((found - truth).abs().max()) for found in (mixed, damped)]
    # Measured 0.002 and 0.017.
    assert errors[0] < 0.3 * errors[1]
