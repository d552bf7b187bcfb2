"""Make the images: render a scene of ours or a .blend file with Blender, or take a dataset or a capture from disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from rgspipe.blender.job import DatasetJob
from rgspipe.blender.render_dataset import render_dataset
from rgspipe.config import RgspipeConfig
from rgspipe.config.scene import MODELLED
from rgspipe.datasets.blend_links import blend_links
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.info import read_info
from rgspipe.datasets.location import point_at_dataset
from rgspipe.datasets.read_files import files_read
from rgspipe.datasets.views import Dataset
from rgspipe.errors import InputError
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.images.check_conventions import check_conventions
from rgspipe.stages.images.odd_views import tell_astray, tell_odd_views
from rgspipe.stages.images.scene_model import scene_model
from rgspipe.stages.sources import require_images
from rgspipe.store.artifacts import Artifact

#: From this share of saturated pixels on, people are told.
NOTICEABLE = 0.01

#: What does without Blender.
OTHERWISE = "Images that you have need none: scene=external or scene=rgbd."

#: Names of files that a sentence lists.
LISTED = 3


def run(context: StageContext) -> None:
    """Leave a dataset in the stage's folder, or a pointer to one that is there, which is checked first."""
    if context.config.scene.kind == "external":
        dataset = _take(context, _existing_path(context.config, "the folder of a dataset"))
        info = read_info(dataset.root)
        along_rays = info is not None and info.depth_convention == "ray_distance"
        names = [view.name for view in dataset.train]
        tell_astray(dataset.train, names, along_rays)
        tell_odd_views(dataset.train, names)
    elif context.config.scene.is_capture:
        _take(context, context.inputs["import_scan"].folder())
    else:
        job = replace(dataset_job(context.config), lamps_known=context.config.scene.lamps == "known")
        render_dataset(job, context.folder, context.config.blender, OTHERWISE)
    context.note(kind=context.config.scene.kind)


def dataset_job(config: RgspipeConfig) -> DatasetJob:
    """What the configuration asks Blender for.

    Raises:
        InputError: `scene.path` names no file, or a material makes light.
    """
    scene = config.scene
    if scene.kind == "blend":
        scene = replace(scene, path=str(_existing_path(config, "a .blend file")))
    return DatasetJob(scene=config.scene.folder, model=scene_model(scene), **vars(config.dataset))


def _take(context: StageContext, root: Path) -> Dataset:
    """Read every file of a dataset that is there, so that what is wrong shows now and not an hour later."""
    dataset = load_dataset(root)
    check_conventions(dataset)
    point_at_dataset(context.folder, root)
    context.note(train=len(dataset.train), test=len(dataset.test), targets=len(dataset.targets))
    _tell_saturated(dataset, context)
    return dataset


def _tell_saturated(dataset: Dataset, context: StageContext) -> None:
    """Say which share of the pixels of training images has a channel that is saturated, where images can be."""
    images = [view for view in dataset.train if view.saturated_from is not None]
    if not images:
        return
    share = float(np.mean([float(view.saturated.any(dim=-1).float().mean()) for view in images]))
    context.note(saturated=round(share, 4))
    if share > NOTICEABLE:
        print(
            f"warning: {100 * share:.1f} % of the pixels of {len(images)} training images are saturated. They tell "
            "only that the scene is at least so bright, and are left out: expose less, or use linear EXR"
        )


def _existing_path(config: RgspipeConfig, what: str) -> Path:
    path = config.scene.path
    if path is None:
        raise InputError("scene.path", expected=what, found="nothing", remedy="Add scene.path=… to the command.")
    if not Path(path).exists():
        raise InputError("scene.path", expected=what, found=f"no such path: {path}", remedy="Correct scene.path.")
    return Path(path).resolve()


def _inputs(config: RgspipeConfig) -> tuple[str, ...]:
    require_images(config, "this stage or one before it")
    return ("import_scan",) if config.scene.is_capture else ()


def _config_keys(config: RgspipeConfig) -> tuple[str, ...]:
    kind = config.scene.kind
    if kind in MODELLED:
        return ("scene.kind", f"scene.{kind}", "scene.lamps", "dataset")
    return ("scene.kind", "scene.lamps", "dataset") if kind == "blend" else ("scene.kind", "scene.lamps")


def _files(config: RgspipeConfig) -> tuple[Path, ...]:
    scene = config.scene
    if scene.kind not in ("external", "blend") or scene.path is None or not Path(scene.path).exists():
        return ()
    path = Path(scene.path).resolve()
    return tuple(files_read(path) if scene.kind == "external" else blend_links(path).files)


def _remarks(config: RgspipeConfig, made: Mapping[str, Artifact]) -> tuple[str, ...]:
    """What of a .blend is not there, and what cannot be watched for changes."""
    if config.scene.kind != "blend" or not _files(config):
        return ()
    links = blend_links(Path(config.scene.path or ""))
    remarks = [
        f"not all files that {path} names can be told ({why}): pack them, or changes of them go unnoticed"
        for path, why in links.unknown.items()
    ]
    names = [f'"{path}"' for path in links.missing]
    if names:
        more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
        remarks.append(f"not there, though the file names it: {', '.join(names[:LISTED])}{more}; what shows it is pink")
    return tuple(remarks)


STAGE = Stage(
    name="generate_dataset",
    help="render the images of a scene, or check those of scene.path",
    run=run,
    inputs=_inputs,
    config_keys=_config_keys,
    files=_files,
    remarks=_remarks,
)
