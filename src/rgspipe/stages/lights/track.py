"""Follow moving lights through a sequence of fit targets: a car's headlights, a lamp that is carried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch

from rgspipe.config import RgspipeConfig
from rgspipe.config.spoken import as_keys
from rgspipe.datasets.gs3 import TargetFolder, target_folders
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.datasets.location import dataset_root, open_dataset
from rgspipe.datasets.read_files import files_read
from rgspipe.datasets.views import Target
from rgspipe.errors import InputError
from rgspipe.evaluation.plots import png_of
from rgspipe.evaluation.track_table import track_figure, track_table
from rgspipe.fitting.fit import FitViews
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.tracking.frame import FrameStatus
from rgspipe.fitting.tracking.track import track_lights
from rgspipe.fitting.words import explained
from rgspipe.scene import LightRig
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.lights.capture import KEYS as CAPTURE_KEYS
from rgspipe.stages.lights.capture import captured_views, tell_masks
from rgspipe.stages.lights.fit_light import Fitter, band_keys
from rgspipe.stages.lights.spec import light_keys, table_files
from rgspipe.stages.lights.targets import used_indices, used_views, view_keys
from rgspipe.stages.scene.effects import effect_keys
from rgspipe.store.files import write_bytes, write_text


def run(context: StageContext) -> None:
    """Write track.csv, a light file per frame under frames/, and track.png; an interrupted run begins again."""
    config = context.config
    folder = _folder(context)
    targets = open_dataset(folder, train=False, test=False).targets
    fitter = Fitter.create(context)
    views, frames, captures = _frames(fitter, targets, config)
    track = track_lights(views, frames, options=config.track, search=fitter.solver(), capture=captures)
    names = [target.name for target in targets]
    truths, surfels = _truths(dataset_root(folder), names), views.prepared.frozen.surfels
    table = track_table(track, names, truths, views.prepared.frozen.size)
    write_text(context.folder / "track.csv", table.to_csv(index=False))
    for name, frame in zip(names, track, strict=True):
        told = {
            "status": str(frame.status),
            "result": str(frame.result.status),
            "reason": as_keys(explained(frame.result.findings)),
        }
        write_lights(context.folder / "frames" / f"{name}.json", frame.result.lights, told)
    origins = torch.stack([view.camera.origin for view in views.prepared.views])
    figure = track_figure(table, truths, surfels.centers, surfels.normals, origins)
    write_bytes(context.folder / "track.png", png_of(figure))
    statuses = {str(status): sum(frame.status == status for frame in track) for status in FrameStatus}
    context.note(frames=len(track), **statuses)


def _frames(
    fitter: Fitter, targets: Sequence[Target], config: RgspipeConfig
) -> tuple[FitViews, list[list[torch.Tensor]], list[ImageCapture]]:
    """The views that all frames share, the images of each frame, and how they were taken.

    A pixel counts as the scene's where every frame says that it is: what a mask or the noise of an edge hides in one
    frame is left out of all, which share what a search prepares.

    Raises:
        InputError: the cameras of two frames differ.
    """
    taken = [captured_views(used_views(target, config), target.name, config) for target in targets]
    [first, *others] = [views for views, _ in taken]
    for target, views in zip(targets[1:], others, strict=True):
        if [view.camera for view in views] != [view.camera for view in first]:
            raise InputError(
                f"target {target.name}",
                expected=f"the cameras of the first frame, {targets[0].name}",
                found="others",
                remedy="Follow frames of fixed cameras.",
            )
    shared = [torch.stack([view.alpha for view in same]).amin(dim=0) for same in zip(first, *others, strict=True)]
    kept = [replace(view, alpha=alpha) for view, alpha in zip(first, shared, strict=True)]
    prepared = fitter.prepare(kept)
    tell_masks("the frames together", kept, prepared)
    return prepared, [[view.image for view in views] for views, _ in taken], [capture for _, capture in taken]


def _truths(root: Path, names: Sequence[str]) -> list[LightRig]:
    """The true lights of every frame; none where one is not known."""
    files = [root / "truth" / f"{name}.json" for name in names]
    return [read_lights(path) for path in files] if all(path.exists() for path in files) else []


def _folder(context: StageContext) -> Path:
    folder = context.config.track.folder
    return context.inputs["generate_targets"].folder() if folder is None else Path(folder)


def _inputs(config: RgspipeConfig) -> list[Need | str]:
    if config.fit.method != "search_lm":
        raise InputError(
            "fit.method",
            expected="search_lm with stage=track",
            found=config.fit.method,
            remedy="Follow lights with fit=search_lm.",
        )
    sequence = [] if config.track.folder is not None else [Need("generate_targets", {"targets.kind": "drive"})]
    return ["freeze", *sequence]


def _files(config: RgspipeConfig) -> list[Path]:
    """The frames, read now: what is wrong with them should show before a scene is trained.

    Raises:
        InputError: there are none, or they have fewer views than are asked for.
    """
    tables, folder = table_files(config), config.track.folder
    if folder is None:
        return tables
    read = files_read(folder)
    frames = target_folders(folder)
    if not frames:
        remedy = "Give the folder that holds targets/<frame>/transforms.json, not targets/ itself or one of the frames."
        raise InputError(folder, expected="targets/ with the frames", found="none", remedy=remedy)
    for frame in map(TargetFolder.of, frames):
        used_indices(frame.name, frame.views, config)
    return [*tables, *read]


def _keys(config: RgspipeConfig) -> list[str]:
    keys = ["track", "seed", *effect_keys(config.effects), *light_keys(config.light), *view_keys(config)]
    return [*keys, "fit.search", "fit.shape", *band_keys(config), *CAPTURE_KEYS]


STAGE = Stage(
    name="track",
    help="follow moving lights through a sequence of fit targets",
    run=run,
    inputs=_inputs,
    config_keys=_keys,
    files=_files,
)
