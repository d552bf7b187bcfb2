"""Mitsuba 3: photographs, and what rays meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mitsuba as mi
import numpy as np

from foreign.cameras import PIXELS, Shot
from foreign.shapes import Lamp, Shape

mi.set_variant("llvm_ad_rgb")


def photograph(shapes: Mapping[str, Shape], shot: Shot, lamps: Sequence[Lamp], samples: int, seed: int) -> np.ndarray:
    """(H, W, 4) linear radiance, premultiplied, and alpha."""
    sensor = {
        "type": "perspective",
        "fov": shot.degrees,
        "near_clip": 1e-4,
        "to_world": mi.ScalarTransform4f().look_at(shot.eye.tolist(), shot.aim.tolist(), [0, 0, 1]),
        "film": {
            "type": "hdrfilm",
            "width": PIXELS,
            "height": PIXELS,
            "rfilter": {"type": "box"},
            "pixel_format": "rgba",
        },
        "sampler": {"type": "independent", "sample_count": samples},
    }
    # Roulette ends paths late: a white room lives of its thirtieth bounce.
    integrator = {"type": "path", "max_depth": 64, "rr_depth": 16}
    scene = mi.load_dict(described(shapes) | _lamps(lamps) | {"integrator": integrator})
    return np.array(mi.render(scene, sensor=mi.load_dict(sensor), seed=seed)).astype(np.float32)


def described(shapes: Mapping[str, Shape]) -> dict[str, Any]:
    """The scene as Mitsuba's dictionary."""
    return {"type": "scene"} | {name: _described(shape) for name, shape in shapes.items()}


def _lamps(lamps: Sequence[Lamp]) -> dict[str, Any]:
    return {f"lamp_{index}": _lamp(lamp) for index, lamp in enumerate(lamps)}


def _lamp(lamp: Lamp) -> dict[str, Any]:
    if not lamp.radius:
        intensity = {"type": "rgb", "value": lamp.intensity.tolist()}
        return {"type": "point", "position": lamp.place.tolist(), "intensity": intensity}
    emitter = {"type": "area", "radiance": {"type": "rgb", "value": lamp.radiance.tolist()}}
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    return {"type": "sphere", "to_world": mi.ScalarTransform4f(lamp.matrix.tolist()), "bsdf": black, "emitter": emitter}


def _described(shape: Shape) -> Any:
    bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": shape.colour.tolist()}}
    if shape.mesh is not None:
        return _mesh(shape, {"type": "twosided", "bsdf": bsdf})
    return {"type": shape.kind, "to_world": mi.ScalarTransform4f(shape.matrix.tolist()), "bsdf": bsdf}


def _mesh(shape: Shape, bsdf: dict[str, Any]) -> Any:
    """Triangles with flat faces."""
    vertices, faces = shape.triangles()
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    properties["face_normals"] = True
    mesh = mi.Mesh("mesh", len(vertices), len(faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh


class Surfaces:
    """What rays meet."""

    def __init__(self, shapes: Mapping[str, Shape]) -> None:
        self.scene = mi.load_dict(described(shapes))

    def distances(self, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """(N,) along unit directions (N, 3); infinite where there is nothing."""
        hit = self._hits(origin, directions)
        return np.where(np.array(hit.is_valid()), np.array(hit.t), np.inf)

    def meets_backs(self, origin: np.ndarray, directions: np.ndarray) -> bool:
        """Whether one of the rays meets a surface from behind, as those from inside of a box do."""
        hit = self._hits(origin, directions)
        facing = np.einsum("nd,dn->n", directions, np.array(hit.n))
        return bool((np.array(hit.is_valid()) & (facing > 0.0)).any())

    def _hits(self, origin: np.ndarray, directions: np.ndarray) -> Any:
        rays = mi.Ray3f(mi.Point3f(*origin.tolist()), mi.Vector3f(directions.T.astype(np.float32)))
        return self.scene.ray_intersect(rays)
