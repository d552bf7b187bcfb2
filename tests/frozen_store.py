"""The small room of `lit_room` as an artifact of stage freeze, and targets of it on disk."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from lit_room import room_cameras, room_surfels
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.light_file import write_lights
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.scene import LightRig, Surfels, srgb
from rgspipe.stages.base import StageContext
from rgspipe.stages.scene import freeze
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key

RESOLUTION = 32


def artifact(root: Path, stage: str, make: Callable[[Path], None]) -> Artifact:
    """An artifact whose files `make` writes into a folder."""

    def build(folder: Path) -> dict:
        make(folder)
        return {}

    recipe = {"config": {}, "inputs": {}, "code": {}}
    return ArtifactStore(root).build(Key("room", stage, "aa"), recipe, build)[0]


def frozen_artifact(root: Path, surfels: Callable[[], Surfels] = room_surfels, **changes: object) -> Artifact:
    """The room, frozen; `changes` to the configuration by key, with __ for the dot."""
    trained = artifact(root, "train_surfels", lambda folder: save_surfels(folder / "surfels.safetensors", surfels()))
    small = {"freeze.gather_rays": 64, "freeze.patches": 150, "freeze.dictionary_grid": 6}
    named = {key.replace("__", "."): value for key, value in changes.items()}
    config = with_changes(RgspipeConfig(stage="freeze"), small | named)
    return artifact(
        root, "freeze", lambda folder: freeze.run(StageContext(config, {"train_surfels": trained}, {}, folder))
    )


def write_targets(folder: Path, images: Mapping[str, Sequence[torch.Tensor]], truths: Mapping[str, LightRig]) -> None:
    """targets/<name>/ with one image per camera of the room, and truth/<name>.json."""
    for name, views in images.items():
        (folder / "targets" / name).mkdir(parents=True)
        for index, image in enumerate(views):
            write_image(folder / "targets" / name / f"view_{index}.exr", image.numpy())
        entries = [frame_entry(f"./view_{index}", camera) for index, camera in enumerate(room_cameras(RESOLUTION))]
        write_transforms(folder / "targets" / name / "transforms.json", entries)
        (folder / "truth").mkdir(exist_ok=True)
        write_lights(folder / "truth" / f"{name}.json", truths[name])
    listed = [{"name": name, "occlusion": "visible"} for name in images]
    (folder / "targets" / "targets.json").write_text(json.dumps({"targets": listed}))


def write_display_target(
    folder: Path, images: Sequence[torch.Tensor], alphas: Sequence[torch.Tensor] | None = None, suffix: str = ".png"
) -> None:
    """A target of 8-bit images of radiance (H, W, 3), clipped at 1, with straight alpha (H, W) if given."""
    folder.mkdir(parents=True)
    for index, image in enumerate(images):
        levels = np.round(255.0 * srgb.encode(image.double().clamp(0.0, 1.0).numpy())).astype(np.uint8)
        if alphas is not None:
            levels = np.concatenate(
                [levels, np.round(255.0 * alphas[index].numpy()[..., None]).astype(np.uint8)], axis=2
            )
        Image.fromarray(levels).save(folder / f"view_{index}{suffix}")
    entries = [frame_entry(f"./view_{index}", camera) for index, camera in enumerate(room_cameras(RESOLUTION))]
    write_transforms(folder / "transforms.json", [entry | {"file_ext": suffix} for entry in entries])
