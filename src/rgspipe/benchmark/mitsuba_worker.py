"""The Mitsuba side: `python -m rgspipe.benchmark.mitsuba_worker render|rays FOLDER`, run by `mitsuba_process`."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from rgspipe.benchmark.mitsuba_process import FIGURES, REQUEST, RESULT, SETTINGS

#: The only variant with derivatives that runs on any processor. It has to be chosen before anything is made.
VARIANT = "llvm_ad_rgb"

#: A measured step is repeated no longer than this [s], but at least twice.
LONGEST = 10.0

#: From OpenGL axes (x right, y up, looks along −z) to Mitsuba's (x left, y up, looks along +z).
TURN = np.diag([-1.0, 1.0, -1.0, 1.0])

POSITION = "light.position"


def main() -> None:
    """Do the task in the folder."""
    task, folder = sys.argv[1], Path(sys.argv[2])
    mi.set_variant(VARIANT)
    with np.load(folder / REQUEST) as stored:
        arrays = dict(stored)
    settings = json.loads((folder / SETTINGS).read_text(encoding="utf-8"))
    figures, results = {"render": render, "rays": cast_rays}[task](arrays, **settings)
    (folder / RESULT).mkdir()
    for name, values in results.items():
        np.save(folder / RESULT / f"{name}.npy", values)
    figures |= {"threads": dr.thread_count(), "variant": VARIANT}
    (folder / FIGURES).write_text(json.dumps(figures), encoding="utf-8")


def render(
    arrays: dict[str, np.ndarray], *, field_of_view: float, resolution: int, max_depth: int, samples: list[int],
    gradient_samples: list[int], repetitions: int,
) -> tuple[dict, dict[str, np.ndarray]]:  # fmt: skip
    """Images of every camera and light for every number of samples, and the time of an image and of a step.

    Takes corners (Q, 4, 3), albedo (Q, 3), poses (K, 4, 4), lights (L, 3) and the target (H, W, 3) of a step;
    gives `images_<spp>` (K, L, H, W, 3).
    """
    figures: dict[str, Any] = {"first_ms": {}, "forward_ms": {}, "step_ms": {}}
    images = {}
    for spp in samples:
        begin = time.perf_counter()
        scene = _room(arrays, field_of_view, resolution, max_depth)
        _array(mi.render(scene, spp=spp))
        figures["first_ms"][spp] = 1e3 * (time.perf_counter() - begin)
        images[f"images_{spp}"] = _every_image(scene, arrays, spp)
        figures["forward_ms"][spp] = _time(lambda seed: _array(mi.render(scene, spp=spp, seed=seed)), repetitions)  # noqa: B023
    scene = _room(arrays, field_of_view, resolution, max_depth)
    for spp in gradient_samples:
        figures["step_ms"][spp] = _time(lambda seed: _step(scene, arrays, spp, seed), repetitions)  # noqa: B023
    figures["gradient"] = _step(scene, arrays, max(gradient_samples), 0).tolist() if gradient_samples else None
    return figures, images


def _room(arrays: dict[str, np.ndarray], field_of_view: float, resolution: int, max_depth: int) -> Any:
    """One mesh with a colour per face, so that no ray pays for choosing among materials; the first light."""
    corners = arrays["corners"]
    bsdf = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "face_color"}}
    room = _quads("room", corners, bsdf)
    room.add_attribute("face_color", 3, np.repeat(arrays["albedo"], 2, axis=0).astype(np.float32).ravel())
    film = {
        "type": "hdrfilm", "width": resolution, "height": resolution, "pixel_format": "rgb",
        "component_format": "float32", "rfilter": {"type": "box"},
    }  # fmt: skip
    sensors = {
        f"camera_{k}": {
            "type": "perspective", "fov": float(np.degrees(field_of_view)), "near_clip": 1e-3, "film": film,
            "to_world": mi.ScalarTransform4f(pose @ TURN),
        }
        for k, pose in enumerate(arrays["poses"])
    }  # fmt: skip
    light = {"type": "point", "position": arrays["lights"][0].tolist(), "intensity": {"type": "rgb", "value": 1.0}}
    integrator = {"type": "path", "max_depth": max_depth}
    return mi.load_dict({"type": "scene", "integrator": integrator, "room": room, "light": light} | sensors)


def _quads(name: str, corners: np.ndarray, bsdf: dict | None = None) -> Any:
    """A mesh of quadrilaterals (Q, 4, 3), two triangles each."""
    properties = mi.Properties()
    if bsdf is not None:
        properties["bsdf"] = mi.load_dict(bsdf)
    count = len(corners)
    first = 4 * np.arange(count, dtype=np.uint32)[:, None, None]
    faces = first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    mesh = mi.Mesh(name, 4 * count, 2 * count, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = corners.astype(np.float32).ravel()
    parameters["faces"] = faces.ravel()
    parameters.update()
    return mesh


def _every_image(scene: Any, arrays: dict[str, np.ndarray], spp: int) -> np.ndarray:
    """(K, L, H, W, 3)."""
    parameters = mi.traverse(scene)
    cameras, lights = len(arrays["poses"]), arrays["lights"]
    images: list[list[np.ndarray]] = [[] for _ in range(cameras)]
    for number, light in enumerate(lights):
        parameters[POSITION] = mi.Point3f(light.tolist())
        parameters.update()
        for camera in range(cameras):
            seed = number * cameras + camera
            images[camera].append(_array(mi.render(scene, sensor=camera, spp=spp, seed=seed)))
    parameters[POSITION] = mi.Point3f(lights[0].tolist())
    parameters.update()
    return np.array(images)


def _step(scene: Any, arrays: dict[str, np.ndarray], spp: int, seed: int) -> np.ndarray:
    """(3,) gradient of the mean squared error of the first camera's image towards the light's position."""
    parameters = mi.traverse(scene)
    parameters[POSITION] = mi.Point3f(arrays["lights"][0].tolist())
    dr.enable_grad(parameters[POSITION])
    parameters.update()
    image = mi.render(scene, parameters, spp=spp, seed=seed)
    dr.backward(dr.mean(dr.square(image - mi.TensorXf(arrays["target"]))))
    return np.array(dr.grad(parameters[POSITION])).reshape(3)


def cast_rays(arrays: dict[str, np.ndarray], *, repetitions: int) -> tuple[dict, dict[str, np.ndarray]]:
    """Time of any-hit rays (`occluded_*`, from origin along a path of length 1) and nearest-hit rays (`nearest_*`).

    Takes quads (N, 4, 3), origins and paths (R, 3), and origins and directions (S, 3).
    """
    scene = mi.load_dict({"type": "scene", "quads": _quads("quads", arrays["quads"])})
    segments = mi.Ray3f(_points(arrays["occluded_origins"]), _points(arrays["occluded_paths"]), 1.0, 0.0, [])
    rays = mi.Ray3f(_points(arrays["nearest_origins"]), _points(arrays["nearest_directions"]))
    dr.eval(segments, rays)
    figures = {
        "occluded_ms": _time(lambda seed: _finish(scene.ray_test(segments)), repetitions),
        "nearest_ms": _time(lambda seed: _finish(scene.ray_intersect_preliminary(rays).t), repetitions),
        "occluded_share": float(np.mean(np.array(scene.ray_test(segments)))),
    }
    return figures, {}


def _points(values: np.ndarray) -> Any:
    return mi.Point3f(np.ascontiguousarray(values.T, dtype=np.float32))


def _finish(result: Any) -> None:
    dr.eval(result)
    dr.sync_thread()


def _array(image: Any) -> np.ndarray:
    return np.array(image)


def _time(run: Callable[[int], object], repetitions: int) -> float:
    """Median [ms] after one run that is not counted."""
    run(0)
    seconds: list[float] = []
    while len(seconds) < 2 or (len(seconds) < repetitions and sum(seconds) < LONGEST):
        begin = time.perf_counter()
        run(1 + len(seconds))
        seconds.append(time.perf_counter() - begin)
    return 1e3 * median(seconds)


if __name__ == "__main__":
    main()
