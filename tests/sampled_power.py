"""A light's power by quasi-Monte-Carlo integration, as pbrt tests its lights."""

from __future__ import annotations

import math

import torch
from scipy.stats import qmc

from rgspipe.scene.lights import AxialLight


def sampled_power(light: AxialLight, limit: float) -> torch.Tensor:
    """(3,) W from 2^14 directions within `limit` [rad] of the axis, beyond which there is no light."""
    u = torch.from_numpy(qmc.Sobol(2, seed=0).random(2**14))
    height, turn = 1.0 - (1.0 - math.cos(limit)) * u[:, 0], 2.0 * math.pi * u[:, 1]
    ring = (1.0 - height * height).clamp(min=0.0).sqrt()
    x, y = torch.linalg.qr(torch.stack([light.direction, *torch.eye(3).double()[:2]], dim=1))[0][:, 1:].T
    directions = height[:, None] * light.direction + ring[:, None] * (turn.cos()[:, None] * x + turn.sin()[:, None] * y)
    return (
        2.0
        * math.pi
        * (1.0 - math.cos(limit))
        * light.relative_intensity_towards(light.position + directions).mean()
        * light.intensity
    )
