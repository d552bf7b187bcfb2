"""The cameras of a user's .blend file, in the coordinates that its surfaces are brought to."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

import bpy
import numpy as np
import torch

from rgspipe.blender.geometry import Geometry
from rgspipe.datasets.named_cameras import NamedCamera, Side
from rgspipe.light_export.world import World

#: What a lens is stated for, by Blender's name.
SIDES: dict[str, Side] = {"AUTO": "longer", "HORIZONTAL": "width", "VERTICAL": "height"}

#: Rays along each side of an image that ask what is cut off.
PROBES = 16

#: Axes whose products are off by less are straight; Blender's are of single precision.
STRAIGHT = 1e-4


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
    kinds = {item: _oddity(item) or distortion for item in cameras}
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


def cut_off(scene: bpy.types.Scene, cameras: Mapping[str, NamedCamera], geometry: Geometry, world: World) -> list[str]:
    """Sentences about cameras in whose images surfaces are missing, by their clip distances, or blurred.

    Args:
        cameras, geometry: ours of `scene`, in scene units.
        world: how the file's coordinates became these.
    """
    items = [item for item in scene.objects if item.type == "CAMERA"]
    own = {name: item.data for item, name in _names(items).items() if name in cameras}
    cut = [name for name, lens in own.items() if _cuts(lens, cameras[name], geometry, world.unit)]
    blurred = [name for name, lens in own.items() if lens.dof.use_dof]
    what = {
        "whose clip distances cut off surfaces that are in our images (a target through it is of another scene)": cut,
        "with depth of field, whose images are blurred, and ours are not": blurred,
    }
    return [f"cameras {kind}: {', '.join(names)}" for kind, names in what.items() if names]


def _cuts(lens: bpy.types.Camera, camera: NamedCamera, geometry: Geometry, unit: float) -> bool:
    """Whether the first surface along some ray of a square image is nearer or farther than `lens` shows any."""
    origins, directions, lengths = camera.of_image(PROBES, PROBES).rays()
    found = zip(origins.numpy(), directions.numpy(), lengths.tolist(), strict=True)
    depths = [geometry.cast(origin, direction)[0] / length * unit for origin, direction, length in found]
    return any(depth < lens.clip_start or lens.clip_end < depth < math.inf for depth in depths)


def _oddity(item: bpy.types.Object) -> str:
    """In which way a camera is none of ours; empty for one that is."""
    if item.data.type != "PERSP":
        return "that are no perspective ones"
    axes = np.array(item.matrix_world.normalized().to_3x3())
    straight = np.allclose(axes.T @ axes, np.eye(3), atol=STRAIGHT)
    return "" if straight and np.linalg.det(axes) > 0.0 else "that are mirrored or sheared"


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
