"""A diffuse plane under lights of every kind, seen from above, and its image in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import torch

from rgspipe.renderer.kernels.places import ways_to
from rgspipe.scene import Camera, Light, SpotLight, look_at
from rgspipe.scene.lights import KINDS, Photometry, ProfileLight

POSITION, INTENSITY = [0.1, -0.2, 0.9], [0.5, 1.0, 2.0]
ALBEDO = (0.2, 0.5, 0.8)
SIZE = 16


def plane_camera() -> Camera:
    """SIZE × SIZE pixels, onto the plane z = 0 from above."""
    return Camera.from_field_of_view(look_at(torch.tensor([0.5, -1.0, 1.5]), torch.zeros(3)), 1.0, SIZE, SIZE)


def plane_lights() -> dict[str, Light]:
    """A light of each kind, by its name, and of spots each profile by its own, in one place and aimed aslant."""
    axis = torch.nn.functional.normalize(torch.tensor([0.3, 0.2, -1.0], dtype=torch.float64), dim=0)
    narrow = {name: kind.shaped().variants()[-1] for name, kind in KINDS.items() if name != "spot"}
    profiles = {"smoothstep": (0.45, 0.4), "gaussian": (0.25, 0.15), "linear": (0.45, 0.2)}
    spots = {name: SpotLight.shaped(name, *angles) for name, angles in profiles.items()}
    place, intensity = (torch.tensor(values, dtype=torch.float64) for values in (POSITION, INTENSITY))
    return {name: shape.at(place, axis, intensity) for name, shape in (narrow | spots).items()}


def yellow_lights() -> dict[str, Light]:
    """A light of each kind that has none of blue."""
    none = torch.tensor([0.5, 1.0, 0.0], dtype=torch.float64)
    return {f"yellow_{name}": replace(plane_lights()[name], intensity=none) for name in KINDS if name != "spot"}


def lopsided_luminaire() -> ProfileLight:
    """A smooth beam that no turn around its axis leaves as it is, in the place of the others."""
    down = torch.linspace(0.0, math.pi, 73, dtype=torch.float64)[:, None]
    around = torch.arange(48, dtype=torch.float64) * (2.0 * math.pi / 48)
    sideways = 0.6 * torch.cos(around) + 0.3 * torch.sin(2.0 * around + 0.5)
    table = Photometry.measured(down[:, 0], around, torch.exp(-down.square() * (1.5 + torch.tanh(down) * sideways)))
    like = plane_lights()["led"]
    return ProfileLight(like.position, like.intensity, like.direction, 0.7, table)


def hard_spots() -> dict[str, SpotLight]:
    """The spots among them with hard edges."""
    spots = {name: light for name, light in plane_lights().items() if isinstance(light, SpotLight)}
    hard = {name: light.cone_angle if name == "linear" else 0.0 for name, light in spots.items()}
    return {f"hard_{name}": replace(light, falloff=hard[name]) for name, light in spots.items()}


def plane_image(light: Light, subsamples: int = 16) -> np.ndarray:
    """L = ρ/π · I · p(θ) cosθ/r², averaged over each pixel's `subsamples`² subpixels."""
    origins, directions, _ = plane_camera().rays(subsamples=subsamples)
    points = origins - (origins[:, 2] / directions[:, 2])[:, None] * directions
    radiance = torch.zeros((len(points), 3), dtype=torch.float64)
    for part in light.parts():
        to_light = ways_to(part.place, points)
        irradiance = to_light[:, 2] / to_light.norm(dim=1) ** 3
        if part.axis is not None:
            irradiance = irradiance * part.relative_intensity_towards(points)
        radiance += torch.tensor(ALBEDO) / math.pi * part.intensity * irradiance[:, None]
    return radiance.reshape(SIZE, SIZE, subsamples**2, 3).mean(dim=2).numpy()
