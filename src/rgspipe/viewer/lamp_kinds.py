"""Lamps of every kind, made of one that is there: at its place, aimed as it, and as bright half the scene away."""

from __future__ import annotations

from torch import Tensor

from rgspipe.scene.lights import KINDS, Light
from rgspipe.viewer.lamp_images import LampImages

#: Said of kinds where they are chosen.
HELP = (
    "At the same place. An led shines with a power of the cosine, a sun in parallel through openings alone, and a "
    "profile as the measured luminaire of a file."
)


def made(kind: str, size: float) -> Light:
    """A lamp of a kind in a scene of `size`; one that has an extent with the smaller of those that a fit tries."""
    return KINDS[kind].shaped().grown(size, free=True)[0]


def in_place_of(light: Light, model: Light, size: float, aim: Tensor) -> Light:
    """The lamp `model` where `light` is, in a scene of `size`.

    Args:
        aim: (3,) where it shines if `light` has no axis, or one of the two is outside the scene and the other is not.
    """
    is_aimed = light.axis is not None and light.distant == model.distant
    share = irradiance(light, size) / irradiance(model, size)
    return model.at(light.position, light.axis if is_aimed else aim, share * light.intensity)


def irradiance(light: Light, size: float) -> float:
    """Of a lamp of the intensity 1, on what it shines straight at, half the scene's `size` away."""
    return 1.0 if light.distant else 4.0 / size**2


def words(light: Light, images: LampImages) -> str:
    """What is to be said of a lamp in a scene beside its numbers."""
    if light.distant and not images.lets_light_in:
        return "No sun reaches this scene: it has no openings."
    if light.distant:
        return "It shines in through openings, the way that you turn its yellow line; where it stands does not matter."
    if light.tabulated:
        return f"Luminaire: {light.label.partition(' ')[2] or 'none, so that it shines with the cosine'}."
    return ""
