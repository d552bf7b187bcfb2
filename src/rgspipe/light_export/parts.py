"""What the formats ask of a light: its colour, its cone, and where its axes are."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.scene import Light, SpotLight
from rgspipe.scene.lights import AxialLight, PanelLight


def peak_and_colour(light: Light) -> tuple[float, list[float]]:
    """The intensity [W/sr] of the brightest channel, and RGB over it."""
    peak = max(float(light.intensity.max()), 1e-300)
    return peak, (light.intensity.double() / peak).tolist()


def frame(light: Light) -> Tensor:
    """(3, 3) unit columns x, y, z: z against its axis, x along a panel's width; the world's without an axis."""
    if light.axis is None:
        return torch.eye(3, dtype=torch.float64)
    axis = torch.nn.functional.normalize(light.axis.double(), dim=0)
    if isinstance(light, PanelLight):
        across, up = light.sides()
    else:
        across, up = PanelLight(light.position, 1.0, axis, 0.0, 0.0).sides()
    return torch.stack([across, -up, -axis], dim=1)


def pose(light: Light) -> Tensor:
    """(4, 4) float64 from `frame` at its place to the world."""
    matrix = torch.eye(4, dtype=torch.float64)
    matrix[:3, :3], matrix[:3, 3] = frame(light), light.position.double()
    return matrix


def cone(light: AxialLight) -> tuple[float, float]:
    """Angles [rad] of the inner and the outer cone: a spot's own, or where 90 and 1 % of the intensity are left."""
    if isinstance(light, SpotLight) and light.profile == "linear":
        return float(light.falloff), float(light.cone_angle)
    if isinstance(light, SpotLight) and light.profile == "smoothstep":
        edge = math.cos(light.cone_angle)
        return math.acos(min(1.0, edge + float(light.falloff) * (1.0 - edge))), float(light.cone_angle)
    angles = torch.linspace(0.0, 0.5 * math.pi, 1801, dtype=torch.float64)
    share = light.relative_intensity_at(angles)
    # Measured luminaires may be brightest to their sides, or dark below.
    lit = (angles[share >= level * float(share.max())] for level in (0.9, 0.01))
    inner, outer = (float(part[-1]) for part in lit)
    return inner, outer


def is_cone(light: Light) -> bool:
    """Whether formats that know nothing but points and cones write it as a cone."""
    return isinstance(light, AxialLight) and not isinstance(light, PanelLight)
