"""What the formats ask of a light: its surface, its colour, and where its axes are."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from rgspipe.names import SpotProfile
from rgspipe.scene import Light, SpotLight
from rgspipe.scene.lights import AxialLight
from rgspipe.scene.lights.panel import sides
from rgspipe.scene.lights.surface import EvenRectangle, EvenSphere, Surface

#: Lights by what people call them: from 1 on, without those that no format holds.
Numbered = Mapping[int, Light]


def surface(light: Light) -> Surface | None:
    """What of it shines evenly; None of a light in one point, and of one whose extent has another shape."""
    nodes = light.nodes(light.places())
    return None if nodes is None else nodes.surface


def radius(light: Light) -> float | None:
    """That of its sphere [m]; None if it is none."""
    shape = surface(light)
    return float(shape.radius) if isinstance(shape, EvenSphere) else None


def rectangle(light: Light) -> tuple[float, float] | None:
    """Width and height [m] of its rectangle; None if it is none."""
    shape = surface(light)
    return (float(shape.width), float(shape.height)) if isinstance(shape, EvenRectangle) else None


def is_of_another_shape(light: Light) -> bool:
    """Whether it has an extent that no format has a word for."""
    nodes = light.nodes(light.places())
    return nodes is not None and nodes.surface is None and len(nodes.positions) > 1


def is_told(light: Light) -> bool:
    """Whether what goes where can be told: from one direction, alike everywhere, or by the angle from an axis."""
    if light.distant:
        return light.axis is not None
    if light.axis is None:
        return light.relative_intensity(light.position[None] + 1.0) is None
    return isinstance(light, AxialLight) and radius(light) is None


def is_cone(light: Light) -> bool:
    """Whether formats that know nothing but points and cones write it as a cone."""
    return isinstance(light, AxialLight) and rectangle(light) is None


def is_spot(light: Light, profile: SpotProfile) -> bool:
    """Whether it is a spot of that profile; what extends a spot may fall otherwise."""
    return type(light) is SpotLight and light.profile == profile


def peak_and_colour(light: Light) -> tuple[float, list[float]]:
    """The intensity [W/sr] of the brightest channel, and RGB over it."""
    peak = max(float(light.intensity.max()), 1e-300)
    return peak, (light.intensity.double() / peak).tolist()


def frame(light: Light) -> Tensor:
    """(3, 3) unit columns x, y, z: z against its axis, x along a rectangle's width; the world's without an axis."""
    if light.axis is None:
        return torch.eye(3, dtype=torch.float64)
    axis = torch.nn.functional.normalize(light.axis.double(), dim=0)
    shape = surface(light)
    across, up = (shape.across, shape.up) if isinstance(shape, EvenRectangle) else sides(axis, axis.new_zeros(()))
    return torch.stack([across, -up, -axis], dim=1)


def pose(light: Light) -> Tensor:
    """(4, 4) float64 from `frame` at its place to the world."""
    matrix = torch.eye(4, dtype=torch.float64)
    matrix[:3, :3], matrix[:3, 3] = frame(light), light.position.double()
    return matrix
