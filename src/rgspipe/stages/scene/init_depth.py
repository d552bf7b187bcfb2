"""Turn the depth of the training views, or a mesh, into a first set of surfels."""

from __future__ import annotations

import time

import numpy as np

from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.datasets.mesh.links import mesh_files
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.degradation.degraded_views import degraded
from rgspipe.scene import NO_CLIP
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.scene.detail import surfel_count
from rgspipe.stages.scene.known_lights import require_lights
from rgspipe.stages.sources import mesh_path
from rgspipe.training.initialise import Footprint, initialise_surfels, surfels_on
from rgspipe.training.initialise.mesh_cloud import cloud_from_mesh


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
        mesh = read_mesh(mesh_path(context.config), context.config.scene.mesh)
        eyes = np.stack([view.camera.origin.numpy() for view in views])
        cloud = cloud_from_mesh(mesh, eyes, count, init.seed)
        surfels = surfels_on(cloud, count, seed=init.seed, clips=init.clips, footprint=footprint, views=views)
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


STAGE = Stage(
    name="init_depth",
    help="turns the depth of the training views, or a mesh, into surfels",
    run=run,
    inputs=lambda config: ["generate_dataset"],
    config_keys=("init", "capture", "scene.kind", "scene.lamps", "scene.mesh"),
    files=lambda config: mesh_files(mesh_path(config)) if config.scene.kind == "mesh" else [],
)
