"""Measurements of the modelled scenes, run by tests in a process of its own: `models_in_blender.py FOLDER NAME…`."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import torch

from rgspipe.blender.job import DatasetJob, RenderSettings
from rgspipe.blender.materials import checker_material, diffuse_material, glossy_material, striped_material
from rgspipe.blender.meshes import add, new_scene, polygon
from rgspipe.blender.models import hotdog
from rgspipe.blender.models.parameters import HotdogParameters, Model, RoomParameters, ZooParameters, kind_of
from rgspipe.blender.passes import Studio
from rgspipe.blender.plan import Frame, make_plan
from rgspipe.blender.scenes import MODELS, open_scene
from rgspipe.blender.targets import lit_share
from rgspipe.scene import Camera, PointLight, look_at
from rgspipe.scene.models import CornellBox, Corridor

SCENES: dict[str, Model] = {
    "cornell": CornellBox(),
    "corner": Corridor(),
    "narrow_corner": Corridor(width=0.28, height=0.35),
    "wide_corner": Corridor(width=0.36, height=1.0),
    "hotdog": HotdogParameters(segments=48),
    "room": RoomParameters(segments=48),
    "zoo_standing": ZooParameters(seed=3, plan="l", views="standing"),
    "zoo_one_side": ZooParameters(seed=1, plan="box", fronts="closed", views="one_side"),
    "zoo_open": ZooParameters(seed=2, plan="box", fronts="open", views="one_side"),
}


def scenes(folder: Path) -> None:
    """Bounds, objects, cameras, lights and targets of every scene, in a folder of their own."""
    folder = folder / "scenes"
    folder.mkdir()
    for name, model in SCENES.items():
        job = DatasetJob(scene=name, model=model, train_views=12, test_views=1, targets_per_class=2, resolution=16)
        (folder / f"{name}.json").write_text(json.dumps(_describe(job)))
    job = replace(job, model=SCENES["corner"])
    (folder / "again.json").write_text(json.dumps(_describe(job)))
    (folder / "other_seed.json").write_text(json.dumps(_describe(replace(job, seed=1))))


def _describe(job: DatasetJob) -> dict:
    prepared = open_scene(job)
    geometry = prepared.geometry
    plan = make_plan(job, prepared.layout, geometry)
    targets = [
        {
            "class": target.occlusion,
            "light": target.frames[0].lights[0].position.tolist(),
            "blocked": [geometry.blocked(f.camera.origin.numpy(), f.lights[0].position.numpy()) for f in target.frames],
            "lit": [lit_share(f.lights[0].position.numpy(), f.camera, geometry) for f in target.frames],
            "origins": [frame.camera.origin.tolist() for frame in target.frames],
        }
        for target in plan.targets
    ]
    return {
        "bounds": [geometry.lo.tolist(), geometry.hi.tolist()],
        "area": sum(face.area for item in prepared.scene.objects for face in item.data.polygons),
        "objects": sorted(item.name for item in prepared.scene.objects),
        "shaders": sorted({node.type for m in bpy.data.materials for node in m.node_tree.nodes if "BSDF" in node.type}),
        "cameras": [frame.camera.origin.tolist() for frame in plan.train],
        "room": [geometry.clearance(frame.camera.origin.numpy()) for frame in plan.frames],
        "views_lit": [lit_share(f.lights[0].position.numpy(), f.camera, geometry) for f in plan.train],
        "targets": targets,
    }


def normals(folder: Path) -> None:
    """Angles [degrees] between the smooth normals at the corners of faces and the faces' own, weighted by area."""
    found = {}
    for model in (HotdogParameters(), RoomParameters(), Corridor()):
        scene = MODELS[kind_of(model)].build(model)
        found[kind_of(model)] = {item.name: _mean_turn(item.data) for item in scene.objects}
    (folder / "normals.json").write_text(json.dumps(found))


def _mean_turn(mesh: bpy.types.Mesh) -> float:
    corners, faces = np.empty(3 * len(mesh.loops), np.float32), np.empty(3 * len(mesh.polygons), np.float32)
    mesh.corner_normals.foreach_get("vector", corners)
    mesh.polygon_normals.foreach_get("vector", faces)
    counts, areas = np.empty(len(mesh.polygons), int), np.empty(len(mesh.polygons))
    mesh.polygons.foreach_get("loop_total", counts)
    mesh.polygons.foreach_get("area", areas)
    cosines = (corners.reshape(-1, 3) * np.repeat(faces.reshape(-1, 3), counts, axis=0)).sum(axis=1)
    angles = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    return float(np.average(angles, weights=np.repeat(areas / counts, counts)))


def plain_hotdog(folder: Path) -> None:
    """An untextured hot dog from above, 48²."""
    hotdog.build(HotdogParameters(textured=False, segments=48))
    _studio(folder, 48, 4).render(_frame("hotdog", (0.2, -1.0, 1.2), (0.3, -0.6, 1.0), 48, 0.9), folder)


def patterns(folder: Path) -> None:
    """Squares with patterns, seen from straight above."""
    colours = (0.1, 0.2, 0.3), (0.7, 0.6, 0.5)
    for name, make in {"checker": checker_material, "stripes": striped_material}.items():
        new_scene()
        _add_square(make(name, *colours, 0.25))
        _studio(folder, 32, 1).render(_frame(name, (0.0, -1e-4, 2.0), (0.1, 0.2, 1.0), 32, 0.5), folder)


def glossy(folder: Path) -> None:
    """A glossy square between light and camera, and the same without gloss."""
    for name in ("glossy", "matte"):
        new_scene()
        albedo = (0.4, 0.3, 0.2)
        _add_square(glossy_material(name, albedo, 0.3, 20.0) if name == "glossy" else diffuse_material(name, albedo))
        _studio(folder, 16, 512).render(_frame(name, (0.5, -1.2, 0.9), (0.1, 0.6, 0.7), 16, 0.7), folder)


def _add_square(material: bpy.types.Material) -> None:
    corners = [(-4.0, -4.0, 0.0), (4.0, -4.0, 0.0), (4.0, 4.0, 0.0), (-4.0, 4.0, 0.0)]
    add(bpy.context.scene, polygon("square", corners), material)


def _studio(folder: Path, resolution: int, samples: int) -> Studio:
    return Studio(bpy.context.scene, RenderSettings(resolution, samples, denoise=False, max_bounces=4), folder)


def _frame(name: str, origin: tuple, light: tuple, resolution: int, angle: float) -> Frame:
    pose = look_at(torch.tensor(origin).double(), torch.zeros(3).double())
    camera = Camera.from_field_of_view(pose, angle, resolution, resolution)
    return Frame(name, camera, (PointLight(torch.tensor(light).double(), torch.ones(3).double()),), 1, True)


if __name__ == "__main__":
    measurements = {one.__name__: one for one in (scenes, normals, plain_hotdog, patterns, glossy)}
    for name in sys.argv[2:]:
        measurements[name](Path(sys.argv[1]))
