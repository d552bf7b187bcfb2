"""Add up the images of single lights to fit targets, laid out as those of a dataset."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rgspipe.blender.pool.pool_file import CAMERAS, INFO, PooledLight
from rgspipe.blender.pool.rigs import RigPlan
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import write_target_list
from rgspipe.datasets.light_file import write_lights
from rgspipe.progress import progress_bar
from rgspipe.store.files import write_bytes


def write_targets(pool_folder: Path, pool: Sequence[PooledLight], rigs: Sequence[RigPlan], folder: Path) -> None:
    """Write the targets of `rigs`, their list and the scene's dataset_info.json, and the true lights apart from them.

    Args:
        pool_folder: a pool, for its cameras and its scene.
        pool: the lights that the rigs' members count.
        folder: where targets/ and truth/ go.
    """
    write_bytes(folder / INFO, (pool_folder / INFO).read_bytes())
    listed = []
    for number, rig in enumerate(progress_bar(rigs, "adding lights", unit="target")):
        name, members = f"rig_{number:04d}", [pool[index] for index in rig.members]
        target = folder / "targets" / name
        for view in range(len(members[0].images)):
            write_image(target / f"view_{view}.exr", *add_images(members, rig, view))
        write_bytes(target / "transforms.json", (pool_folder / CAMERAS).read_bytes())
        shares = [{"share": share} for share in rig.shares]
        write_lights(folder / "truth" / f"{name}.json", rig.lights, {"lights": shares})
        listed.append((name, common_class([light.occlusion for light in members])))
    write_target_list(folder, listed)


def add_images(members: Sequence[PooledLight], rig: RigPlan, view: int) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (H, W, 3) of a rig, Σ I_k L_k over its lights, and their mean alpha (H, W)."""
    images = [light.image(view) for light in members]
    parts = [light.intensity.numpy() * image for light, (image, _) in zip(rig.lights, images, strict=True)]
    return np.sum(parts, axis=0), np.mean([alpha for _, alpha in images], axis=0)


def common_class(classes: Sequence[str]) -> str:
    """The class of all lights of a rig, "unknown" if they differ."""
    return classes[0] if len(set(classes)) == 1 else "unknown"
