"""Render one frame and store its passes as the dataset's own files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from rgspipe.blender import cycles
from rgspipe.blender.exr_files import read_channels, write_channels, write_image
from rgspipe.blender.job import RenderSettings
from rgspipe.blender.lamp import place_lamp
from rgspipe.blender.plan import Frame
from rgspipe.light_export.world import World
from rgspipe.scene import Camera, Light

#: Suffixes of the surface files beside an image, and their channels.
SURFACE_CHANNELS = {"depth": ("Z",), "normal": ("X", "Y", "Z"), "albedo": ("R", "G", "B")}

#: What Blender called its passes before version 5, and calls them now.
RENAMED = {"DiffCol": "Diffuse Color"}

#: Cycles' depth of what is no surface.
NO_DEPTH = np.float32(1e10)

#: Blender's own coordinates are the scene's.
HERE = World()

#: Of Blender's camera, in its millimetres; only the ratio to the focal length matters.
SENSOR_WIDTH = 36.0


class Studio:
    """A scene with one camera, and lamps that are moved from frame to frame.

    Args:
        scene: what stands there already; its camera is replaced.
        settings: the quality of its images.
        scratch: folder for Blender's own output.
        world: where cameras, lamps and depths of the scene are in what Blender renders.
    """

    def __init__(self, scene: bpy.types.Scene, settings: RenderSettings, scratch: Path, world: World = HERE) -> None:
        self._scene, self._settings, self._scratch, self._world = scene, settings, scratch, world
        cycles.configure(scene, settings)
        self._camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        self._camera.data.clip_start, self._camera.data.clip_end = 1e-3 * world.unit, 1e3 * world.unit
        scene.collection.objects.link(self._camera)
        scene.camera = self._camera
        self._lamps = [self._new_lamp()]

    def render(self, frame: Frame, folder: Path) -> None:
        """Render `frame` and write its files below `folder`, each whole or not at all."""
        if frame.has_surfaces:
            self._write_surfaces(frame, folder)
        image, alpha = self.radiance(frame.camera, frame.lights, frame.seed, frame.samples)
        write_image(folder / f"{frame.name}.exr", image, alpha)

    def radiance(
        self, camera: Camera, lights: Sequence[Light], seed: int, samples: int | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Mean over each pixel: radiance (H, W, 3) and alpha (H, W); with the settings' samples by default."""
        place_camera(self._camera, camera, self._world)
        self._switch_on(lights)
        cycles.use_colour_sampling(self._scene, samples or self._settings.samples, self._settings.denoise, seed)
        passes = self._passes()
        return _stack(passes, "Combined", "RGB"), passes["Combined.A"]

    def _new_lamp(self) -> bpy.types.Object:
        lamp = bpy.data.objects.new("light", bpy.data.lights.new("light", "POINT"))
        lamp.visible_camera = False
        self._scene.collection.objects.link(lamp)
        return lamp

    def _switch_on(self, lights: Sequence[Light]) -> None:
        """Place a lamp for each of `lights`, and leave no other on."""
        self._lamps += [self._new_lamp() for _ in range(len(lights) - len(self._lamps))]
        for index, lamp in enumerate(self._lamps):
            lamp.hide_render = index >= len(lights)
        for lamp, light in zip(self._lamps, self._world.lights(tuple(lights)), strict=False):
            place_lamp(lamp, light)

    def _passes(self) -> dict[str, np.ndarray]:
        """Render, and return all passes by "<pass>.<channel>"."""
        path = self._scratch / "render.exr"
        self._scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=self._scene.name)
        channels = read_channels(path)
        parts = {tuple(name.split(".")[1:]): values for name, values in channels.items()}
        return {f"{RENAMED.get(name, name)}.{channel}": values for (name, channel), values in parts.items()}

    def _write_surfaces(self, frame: Frame, folder: Path) -> None:
        place_camera(self._camera, frame.camera, self._world)
        self._switch_on(frame.lights)
        cycles.use_center_sampling(self._scene)
        passes = self._passes()
        depth = passes["Depth.Z"]
        depth[depth != NO_DEPTH] /= self._world.unit
        normal = face_camera(_stack(passes, "Normal", "XYZ"), frame.camera)
        arrays = {"depth": depth[..., None], "normal": normal, "albedo": _stack(passes, "Diffuse Color", "RGB")}
        for kind, names in SURFACE_CHANNELS.items():
            # Half precision: normals to 5e-4, albedo to 3e-4 at worst, below what any later step resolves.
            stored = arrays[kind] if kind == "depth" else arrays[kind].astype(np.float16)
            write_channels(folder / f"{frame.name}_{kind}.exr", {n: stored[..., i] for i, n in enumerate(names)})


def place_camera(item: bpy.types.Object, camera: Camera, world: World = HERE) -> None:
    """Give Blender's camera the pose and field of view of ours (square pixels, axis in the middle)."""
    pose = camera.camera_to_world.double().clone()
    pose[:3, 3] = world.place(pose[:3, 3])
    item.matrix_world = Matrix(pose.tolist())
    item.data.sensor_fit = "HORIZONTAL"
    # A wide sensor, because Blender silently raises focal lengths below 1 mm.
    item.data.sensor_width = SENSOR_WIDTH
    item.data.lens = SENSOR_WIDTH * camera.fx / camera.width
    stored = item.data.lens / SENSOR_WIDTH * camera.width
    if abs(stored - camera.fx) > 1e-5 * camera.fx:
        raise ValueError(
            f"Blender takes no focal length of {camera.fx:g} pixels at {camera.width} (it made it {stored:g})"
        )


def face_camera(normal: np.ndarray, camera: Camera) -> np.ndarray:
    """Unit normals (H, W, 3) turned towards the camera; 0 stays 0."""
    _, directions, _ = camera.rays()
    away = (normal * directions.numpy().reshape(normal.shape)).sum(axis=-1, keepdims=True) > 0
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    unit = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.5)
    return np.where(away, -unit, unit)


def frame_files(frame: Frame, folder: Path) -> list[Path]:
    """The files of a frame; the image, written last, stands last."""
    surfaces = [folder / f"{frame.name}_{kind}.exr" for kind in SURFACE_CHANNELS] if frame.has_surfaces else []
    return [*surfaces, folder / f"{frame.name}.exr"]


def _stack(passes: dict[str, np.ndarray], name: str, channels: str) -> np.ndarray:
    return np.stack([passes[f"{name}.{channel}"] for channel in channels], axis=-1)
