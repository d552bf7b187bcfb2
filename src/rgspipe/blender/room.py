"""A room of rectangles in bpy, and its images with their noise."""

from __future__ import annotations

from pathlib import Path

import bpy

from rgspipe.blender.exr_files import write_channels
from rgspipe.blender.materials import diffuse_material
from rgspipe.blender.meshes import add, new_scene, polygon
from rgspipe.blender.passes import Studio
from rgspipe.blender.room_job import RoomFrame, RoomJob


def build_room(job: RoomJob) -> bpy.types.Scene:
    """A new scene that holds the rectangles and nothing else: no light, camera or world."""
    scene = new_scene()
    for index, (corners, albedo) in enumerate(zip(job.corners, job.albedo, strict=True)):
        name = f"rectangle_{index}"
        add(scene, polygon(name, corners), diffuse_material(name, tuple(albedo)))
    bpy.context.view_layer.update()
    return scene


def write_frame(studio: Studio, frame: RoomFrame, folder: Path) -> None:
    """Render an image twice and write the mean (R, G, B) and half the difference (noise.R, …).

    Half the difference of two independent halves is as large as the error of their mean.
    """
    first, second = (studio.radiance(frame.camera, (frame.light,), seed)[0] for seed in frame.seeds)
    mean, noise = 0.5 * (first + second), 0.5 * (first - second)
    channels = {name: mean[..., index] for index, name in enumerate("RGB")}
    channels |= {f"noise.{name}": noise[..., index] for index, name in enumerate("RGB")}
    write_channels(frame_files(frame, folder)[0], channels)


def frame_files(frame: RoomFrame, folder: Path) -> list[Path]:
    """The file of a frame."""
    return [folder / f"{frame.name}.exr"]
