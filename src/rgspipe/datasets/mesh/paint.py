"""Colours of a mesh that was decoded, as reflectance at the corners of its triangles, and in textures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from rgspipe.datasets.mesh.gltf_materials import GltfMaterial
from rgspipe.datasets.mesh.texture import texture_light, without_metal
from rgspipe.datasets.ply.header import COLOURS
from rgspipe.errors import InputError
from rgspipe.scene import srgb
from rgspipe.scene.mesh import Numbers, Paint

#: How far places may lie beyond the ends of a texture that does not repeat: what exporters round.
BEYOND = 1e-4


def check_shares(part: Any, path: Path) -> None:
    """Refuse colours of a PLY in floats that are no shares of 1: the library has cut them off by then.

    Raises:
        InputError: names the element and the property.
    """
    for name, element in part.metadata.get("_ply_raw", {}).items():
        data = element.get("data")
        given = getattr(getattr(data, "dtype", None), "names", None) or (data if isinstance(data, dict) else ())
        for key in set(COLOURS).intersection(given):
            values = np.asarray(data[key])
            if values.dtype.kind == "f" and not ((values >= 0.0) & (values <= 1.0)).all():
                found = f"{values.min():g} to {values.max():g}"
                where, remedy = f"{path}: element {name}, property {key}", "Export the mesh with colours in bytes."
                raise InputError(where, expected="floats from 0 to 1", found=found, remedy=remedy)


def paint_of(part: Any, faces: np.ndarray, materials: Sequence[GltfMaterial], path: Path) -> Paint:
    """The colours of one mesh; `materials` are those of a glTF, whose colours are light.

    Raises:
        InputError: a broken texture, or one that is needed beyond its ends and does not repeat.
    """
    visual, count = part.visual, len(faces)
    if isinstance(getattr(visual, "material", None), trimesh.visual.material.PBRMaterial):
        return _gltf_paint(part, faces, materials[int(visual.material.name)], path)
    if visual.kind == "texture":
        colour, image = _material(visual.material)
        diffuse = 1.0 - float(visual.material.kwargs.get("pm", [0.0])[0])
        if image is None or (uv := _places(part)) is None:
            return _plain(np.broadcast_to(colour * diffuse, (count, 3, 3)))
        # Kd beside map_Kd is what exporters leave there.
        light = texture_light(image, path)
        return Paint(np.full((count, 3, 3), diffuse), uv[faces], np.zeros(count, np.int64), (light,))
    if visual.kind == "vertex":
        return _plain(_display(visual.vertex_colors)[faces])
    if visual.kind == "face":
        return _plain(np.repeat(_display(visual.face_colors)[:, None], 3, axis=1))
    return _plain(np.full((count, 3, 3), np.nan))


def _plain(corners: Numbers) -> Paint:
    return Paint(corners, np.zeros((len(corners), 3, 2)), np.full(len(corners), -1))


def _places(part: Any) -> Numbers | None:
    """(V, 2) in the texture, if each point has one."""
    given = np.asarray(part.visual.uv if part.visual.uv is not None else (), np.float64)
    return given if given.shape == (len(part.vertices), 2) and np.isfinite(given).all() else None


def _gltf_paint(part: Any, faces: np.ndarray, material: GltfMaterial, path: Path) -> Paint:
    """Colour of the material times those of the points times the texture, without what metal reflects of it."""
    given, count = part.visual.material, len(faces)
    colours = part.visual.vertex_attributes.get("color")
    corners = np.broadcast_to(material.colour, (count, 3, 3))
    if colours is not None:
        corners = corners * _light(colours)[faces]
    uv, base, metal = _places(part), given.baseColorTexture, given.metallicRoughnessTexture
    metal = metal if material.metallic > 0.0 else None
    if uv is None or (base is None and metal is None):
        return _plain(corners * (1.0 - material.metallic))
    if not material.repeats:
        uv = _within(uv[np.unique(faces)], uv, path)
    light = None if base is None else texture_light(base, path)
    if metal is None:
        corners = corners * (1.0 - material.metallic)
    else:
        light = without_metal(light, metal, material.metallic, path)
    return Paint(corners, uv[faces], np.zeros(count, np.int64), (light,))


def _within(used: Numbers, uv: Numbers, path: Path) -> Numbers:
    """Places in a texture that ends, just within it: its last texels are not followed by its first."""
    if used.min() < -BEYOND or used.max() > 1.0 + BEYOND:
        expected = "textures that repeat beyond their ends (wrapS and wrapT 10497), or places within"
        found = f"another way of one, and places from {used.min():g} to {used.max():g}"
        remedy = "Export it with textures that repeat, or with places in them from 0 to 1."
        raise InputError(path, expected=expected, found=found, remedy=remedy)
    return np.clip(uv, 0.0, np.nextafter(1.0, 0.0))


def _light(levels: np.ndarray) -> Numbers:
    """(N, 3) linear, of (N, 3 or 4) levels of 8 or 16 bits, or shares."""
    values = np.asarray(levels)[:, :3]
    return values / np.iinfo(values.dtype).max if values.dtype.kind == "u" else values.astype(np.float64)


def _display(levels: np.ndarray) -> Numbers:
    """(N, 3) linear, of (N, 3 or 4) bytes that a screen shows."""
    return srgb.decode(_light(levels))


def _material(material: Any) -> tuple[Numbers, Image.Image | None]:
    """Linear colour (3,), NaN if it has none, and the image that it is times, if there is one."""
    # Of one that says nothing of a colour the library invents a grey, of none at all a grey picture without a format.
    made_up = material.image is not None and material.image.format is None
    return np.asarray(material.kwargs.get("kd", [np.nan] * 3), np.float64), None if made_up else material.image
