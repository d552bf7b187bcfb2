"""Turn the depth of the training views into a first set of surfels."""

from __future__ import annotations

import time

from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.datasets.tensoir import require_lights
from rgspipe.degradation.capture import degraded
from rgspipe.scene import NO_CLIP
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.detail import surfel_count
from rgspipe.training.initialise import Footprint, initialise_surfels


def run(context: StageContext) -> None:
    """Write surfels.safetensors."""
    init = context.config.init
    root = dataset_root(context.inputs["generate_dataset"].folder())
    views = degraded(load_dataset(root, test=False, targets=False).train, context.config.capture)
    if context.config.scene.lamps == "known":
        require_lights(views, root)
    start = time.perf_counter()
    surfels = initialise_surfels(
        views,
        surfel_count(context.config),
        seed=init.seed,
        normals=init.normals,
        clips=init.clips,
        footprint=Footprint(scale=init.scale),
        where=root,
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
    help="turns the depth of the training views into surfels",
    run=run,
    inputs=lambda config: ["generate_dataset"],
    config_keys=("init", "capture", "scene.kind", "scene.lamps"),
)
