"""The cameras of a user's .blend file, in the coordinates that its surfaces are brought to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import bpy
import torch

from rgspipe.datasets.named_cameras import NamedCamera, Side

#: What a lens is stated for, by Blender's name.
SIDES: dict[str, Side] = {"AUTO": "longer", "HORIZONTAL": "width", "VERTICAL": "height"}


def own_cameras(
    scene: bpy.types.Scene, rescale: float, offset: tuple[float, float, float], distortion: str = ""
) -> tuple[dict[str, NamedCamera], list[str]]:
    """Its perspective cameras by name, and sentences about the others.

    Args:
        rescale, offset: a point x of the file becomes (x + offset) · rescale.
        distortion: the scene's; with any, none of its cameras is ours.
    """
    cameras = [item for item in scene.objects if item.type == "CAMERA"]
    names = _names(cameras)
    kinds = {item: distortion if item.data.type == "PERSP" else "that are no perspective ones" for item in cameras}
    pinholes = {names[item]: _camera(item, rescale, offset) for item, kind in kinds.items() if not kind}
    others = {kind: [names[item] for item in cameras if kinds[item] == kind] for kind in kinds.values() if kind}
    return pinholes, [f"cameras {kind}, and cannot be a target's: {', '.join(some)}" for kind, some in others.items()]


def image_distortion(scene: bpy.types.Scene) -> str:
    """In which way a render of `scene`, as it is set, is not the whole image of a pinhole; empty for one that is."""
    render = scene.render
    if render.pixel_aspect_x != render.pixel_aspect_y:
        return f"whose pixels are not square (aspect {render.pixel_aspect_x:g} : {render.pixel_aspect_y:g})"
    region = (render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y)
    if render.use_border and render.use_crop_to_border and region != (0.0, 0.0, 1.0, 1.0):
        return "whose images are cropped to a render region"
    return ""


def _names(cameras: Sequence[bpy.types.Object]) -> dict[bpy.types.Object, str]:
    """What each is called: as in its file, and with Blender's name of its library where another is called so."""
    count = Counter(item.name for item in cameras)
    return {item: item.name if count[item.name] == 1 else item.name_full for item in cameras}


def _camera(item: bpy.types.Object, rescale: float, offset: tuple[float, float, float]) -> NamedCamera:
    pose = torch.tensor([[*row] for row in item.matrix_world.normalized()], dtype=torch.float64)
    pose[:3, 3] = (pose[:3, 3] + torch.tensor(offset, dtype=torch.float64)) * rescale
    lens = item.data
    sensor = lens.sensor_height if lens.sensor_fit == "VERTICAL" else lens.sensor_width
    return NamedCamera(pose, lens.lens / sensor, SIDES[lens.sensor_fit], (lens.shift_x, lens.shift_y))
