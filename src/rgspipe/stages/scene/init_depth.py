"""Turn the depth of the training views, or a mesh, into a first set of surfels."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.mesh.links import mesh_files
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_views import degraded
from rgspipe.scene import NO_CLIP, Surfels
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.scene.detail import surfel_count
from rgspipe.stages.scene.known_lights import require_lights
from rgspipe.stages.sources import mesh_path
from rgspipe.training.initialise import Footprint, initialise_surfels, surfels_on


def run(context: StageContext) -> None:
    """Write surfels.safetensors."""
    init = context.config.init
    root = dataset_root(context.inputs["generate_dataset"].folder())
    views = degraded(load_dataset(root, test=False, targets=False).train, context.config.capture)
    if context.config.scene.lamps == "known":
        require_lights(views, root)
    start, footprint = time.perf_counter(), Footprint(scale=init.scale)
    count = surfel_count(context.config)
    if context.config.scene.kind == "mesh":
        surfels = _from_mesh(context.config, views, count, footprint)
    else:
        surfels = initialise_surfels(
            views, count, seed=init.seed, normals=init.normals, clips=init.clips, footprint=footprint, where=root
        )
    seconds = time.perf_counter() - start
    save_surfels(context.folder / "surfels.safetensors", surfels)
    context.note(
        count=len(surfels),
        with_edges=int((surfels.clip_offsets[:, 0] < NO_CLIP).sum()),
        seconds=round(seconds, 3),
    )


def _from_mesh(config: RgspipeConfig, views: Sequence[View], count: int, footprint: Footprint) -> Surfels:
    # Slow to import (trimesh, scipy.stats), and every other kind of scene goes through this stage, too.
    from rgspipe.datasets.mesh.file import read_mesh
    from rgspipe.training.initialise.mesh_cloud import cloud_from_mesh

    init = config.init
    mesh = read_mesh(mesh_path(config), config.scene.mesh)
    eyes = np.stack([view.camera.origin.numpy() for view in views])
    cloud = cloud_from_mesh(mesh, eyes, count, init.seed)
    return surfels_on(cloud, count, seed=init.seed, clips=init.clips, footprint=footprint, views=views)


STAGE = Stage(
    name="init_depth",
    help="turns the depth of the training views, or a mesh, into surfels",
    run=run,
    inputs=lambda config: ["generate_dataset"],
    config_keys=("init", "capture", "scene.kind", "scene.lamps", "scene.mesh"),
    files=lambda config: mesh_files(mesh_path(config)) if config.scene.kind == "mesh" else [],
)
