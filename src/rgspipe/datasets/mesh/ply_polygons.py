"""Triangles of a PLY whose faces have more corners, with their colours: its decoder has fans, and mixes colours up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from rgspipe.datasets.mesh.polygons import clipped, fan
from rgspipe.datasets.ply.header import COLOURS, FACE_PLACES
from rgspipe.errors import InputError

#: What the list of a face's points, and the places of points in a texture, are called.
POINTS = ("vertex_index", "vertex_indices")
PLACES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))


def with_triangles(part: Any, path: Path) -> Any:
    """A mesh that was decoded, with the triangles that its polygons cover; as it is if it has triangles alone.

    Raises:
        InputError: a polygon crosses itself, or lists that differ in length were read as if they did not.
    """
    elements = part.metadata.get("_ply_raw", {})
    faces = elements.get("face", {}).get("data")
    if (name := next((one for one in POINTS if one in _names(faces)), None)) is None:
        return part
    polygons = _lists(faces, name, path)
    if polygons.shape[1:] == (3,) or all(len(polygon) == 3 for polygon in polygons):
        return part
    points = np.column_stack([elements["vertex"]["data"][axis] for axis in "xyz"]).astype(np.float64)
    named = np.concatenate(polygons)
    if named.min() < 0 or named.max() >= len(points):
        return part  # which is refused for that
    corners, owners = _corners(points, polygons, path)
    used = named[corners].reshape(-1)
    visual = {
        "vertex_colors": _colours(elements["vertex"]["data"], used),
        "face_colors": _colours(faces, owners),
    }
    if part.visual.kind == "texture":
        places = _texture_places(elements, corners.reshape(-1), used, path)
        visual = {"visual": trimesh.visual.TextureVisuals(uv=places, material=part.visual.material)}
    made = np.arange(len(used)).reshape(-1, 3)
    return trimesh.Trimesh(points[used], made, process=False, metadata=part.metadata, **visual)


def _names(data: Any) -> Sequence[str]:
    """Properties of an element, which is an array with names, or a dictionary where it was text."""
    return getattr(getattr(data, "dtype", None), "names", None) or (list(data) if isinstance(data, dict) else ())


def _lists(data: Any, name: str, path: Path) -> Any:
    """The lists of a property, row by row."""
    values = data[name]
    if not getattr(values.dtype, "names", None):
        return values
    if len(values) and (values["f0"] != values["f0"][0]).any():
        expected, remedy = "as many entries in each row of a binary list", "Triangulate the faces when you export it."
        where, found = f"{path}: element face, property {name}", f"{values['f0'][0]}, and others"
        raise InputError(where, expected=expected, found=found, remedy=remedy)
    return values["f1"]


def _corners(points: np.ndarray, polygons: Any, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3) corners of triangles, counted through all polygons, and (T,) the polygon of each."""
    own, fans = clipped(points, polygons, path), {}
    parts, first = [], 0
    for number, polygon in enumerate(polygons):
        count = len(polygon)
        if count not in fans:
            fans[count] = fan(count)
        parts.append(own.get(number, fans[count]) + first)
        first += count
    return np.concatenate(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])


def _colours(data: Any, rows: np.ndarray) -> np.ndarray | None:
    given = [data[name] for name in COLOURS if name in _names(data)]
    return np.column_stack(given)[rows] if len(given) >= 3 else None


def _texture_places(elements: dict[str, Any], corners: np.ndarray, points: np.ndarray, path: Path) -> np.ndarray:
    """(N, 2) of corners, which lie at points (N,)."""
    faces, vertices = elements["face"]["data"], elements["vertex"]["data"]
    if FACE_PLACES in _names(faces):
        return np.concatenate(_lists(faces, FACE_PLACES, path)).reshape(-1, 2)[corners]
    names = next((pair for pair in PLACES if set(pair) <= set(_names(vertices))), PLACES[-1])
    return np.column_stack([vertices[name] for name in names])[points]
