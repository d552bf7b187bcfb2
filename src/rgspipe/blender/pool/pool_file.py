"""The files of a pool of single lights.

`lights.json` is a light file that also names each light's folder and class; a folder holds one image for each camera
of `cameras.json`, under the names that this file gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rgspipe.datasets.exr import read_image
from rgspipe.datasets.gs3_write import frame_entry, write_info, write_transforms
from rgspipe.datasets.json_file import read_json, required
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.scene import Camera, Light

LIGHTS, CAMERAS, INFO = "lights.json", "cameras.json", "dataset_info.json"


@dataclass(frozen=True)
class PooledLight:
    """A light of a pool.

    Attributes:
        light: 1 W/sr, on its axis if it has one.
        occlusion: its class.
        images: one file for each camera.
    """

    light: Light
    occlusion: str
    images: tuple[Path, ...]

    def image(self, view: int) -> tuple[np.ndarray, np.ndarray]:
        """What camera `view` sees of the scene in this light: radiance (H, W, 3) per W/sr, and alpha (H, W)."""
        return read_image(self.images[view])

    def brightness(self) -> np.ndarray:
        """(3,) mean radiance per W/sr over all pixels of all cameras."""
        return np.mean([self.image(view)[0].mean(axis=(0, 1), dtype=float) for view in range(len(self.images))], axis=0)


def write_pool(
    folder: Path,
    scene: str,
    lights: Sequence[tuple[str, str, Light]],
    cameras: Sequence[Camera],
    bounds: list[list[float]],
    rescale: float,
    offset: list[float],
) -> None:
    """Write everything but the images.

    Args:
        lights: folder, class and light of each.
        bounds, rescale, offset: of the scene, as in dataset_info.json.
    """
    further = [{"folder": name, "occlusion": occlusion} for name, occlusion, _ in lights]
    write_lights(folder / LIGHTS, tuple(light for _, _, light in lights), {"lights": further})
    entries = [frame_entry(f"view_{number}", camera) for number, camera in enumerate(cameras)]
    write_transforms(folder / CAMERAS, entries)
    write_info(folder, scene, bounds, rescale, offset)


def read_pool(folder: Path) -> list[PooledLight]:
    """The lights of a pool; their images are read when they are asked for.

    Raises:
        InputError: a file is missing or broken.
    """
    path = folder / LIGHTS
    entries = required(read_json(path, "the lights of a pool"), "lights", path)
    views = len(required(read_json(folder / CAMERAS, "the cameras of a pool"), "frames", folder / CAMERAS))
    return [
        PooledLight(light, entry["occlusion"], tuple(folder / entry["folder"] / f"view_{k}.exr" for k in range(views)))
        for light, entry in zip(read_lights(path), entries, strict=True)
    ]
