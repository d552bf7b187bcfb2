"""A room as surfels, and targets of it under known lights: what the jobs on the cluster fit."""

from __future__ import annotations

from pathlib import Path

import torch

from lit_room import frozen_room, room_cameras, room_surfels
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.ply.file import save_ply
from rgspipe.fitting import FitViews
from rgspipe.scene import PointLight

#: Where the light of each target is.
LIGHTS = {
    "left": (-0.2, -0.25, 0.3),
    "middle": (0.1, -0.25, 0.3),
    "right": (0.3, -0.2, 0.2),
    "hidden": (0.32, 0.3, -0.3),
}


def write_room(folder: Path) -> None:
    """Write room.ply and a folder of two views for each light."""
    save_ply(folder / "room.ply", room_surfels().to(torch.float32))
    cameras = room_cameras(32)
    views = FitViews.prepare(frozen_room(), cameras, sharp=True)
    intensity = torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64)
    for name, position in LIGHTS.items():
        target = folder / name
        target.mkdir()
        light = PointLight(torch.tensor(position, dtype=torch.float64), intensity)
        for index, image in enumerate(views.render(light)):
            write_image(target / f"view_{index}.exr", image.numpy())
        write_transforms(
            target / "transforms.json", [frame_entry(f"./view_{k}", camera) for k, camera in enumerate(cameras)]
        )
