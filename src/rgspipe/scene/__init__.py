"""Plain data: cameras, surfels, lights, the curve of display values. Nothing here renders, and no file is read but
through `Surfels.from_ply`, which hands it to those who know the format.
"""

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
