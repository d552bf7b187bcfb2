"""Plain data: cameras, surfels, lights, the curve of display values. Nothing here reads a file or renders."""

from rgspipe.scene.camera import Camera, look_at
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.lights import Light, LightRig, PointLight, SpotLight
from rgspipe.scene.surfels import NO_CLIP, Coverage, Surfels

__all__ = [
    "NO_CLIP",
    "Camera",
    "Coverage",
    "Gloss",
    "Light",
    "LightRig",
    "PointLight",
    "SpotLight",
    "Surfels",
    "look_at",
]
