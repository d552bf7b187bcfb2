"""Pictures of the dataset behind a report."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd

from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.views import Dataset
from rgspipe.evaluation.classes import class_order
from rgspipe.evaluation.light_plot import CameraMark
from rgspipe.evaluation.plots import png_of
from rgspipe.pages.gallery import Gallery, make_gallery
from rgspipe.pages.plan_figure import plan_figure
from rgspipe.scene import Camera, LightRig, Surfels
from rgspipe.store.artifacts import Artifact

#: The fit whose errors stand under targets.
METHOD = "search_lm"


def dataset_gallery(
    made: Artifact | None, surfels: Surfels | None, targets: pd.DataFrame, lamps: LightRig = ()
) -> Gallery | None:
    """Training views, targets by class, and a plan of cameras and lights; None without a dataset.

    Args:
        made: what generate_dataset made.
        surfels: the frozen scene, for the plan.
        targets: rows of `target_table`, for the errors under the targets.
        lamps: that were found in training views of unknown light.
    """
    if made is None:
        return None
    dataset = open_dataset(made.folder())
    truths = _truths(dataset)
    plan = _plan(dataset, truths, surfels, lamps)
    return make_gallery(dataset.train, len(dataset.test), dataset.targets, truths, _errors(targets), plan)


def camera_mark(camera: Camera) -> CameraMark:
    """A camera as figures draw it."""
    angle = 2.0 * math.atan(0.5 * camera.width / camera.fx)
    return CameraMark(tuple(camera.origin.tolist()), tuple((-camera.camera_to_world[:3, 2]).tolist()), angle)


def _truths(dataset: Dataset) -> dict[str, LightRig]:
    """The true lights of the targets that have a light file."""
    paths: dict[str, Path] = {target.name: dataset.root / "truth" / f"{target.name}.json" for target in dataset.targets}
    return {name: read_lights(path) for name, path in paths.items() if path.exists()}


def _errors(targets: pd.DataFrame) -> dict[str, float]:
    """The position error of every target of the main method with the fewest views."""
    rows = targets[targets["method"] == METHOD]
    if rows.empty:
        return {}
    rows = rows[rows["views"] == rows["views"].min()]
    return dict(zip(rows["target"], rows["position_error"].astype(float), strict=True))


def _plan(dataset: Dataset, truths: dict[str, LightRig], surfels: Surfels | None, lamps: LightRig) -> bytes | None:
    classes = class_order([target.occlusion for target in dataset.targets])
    placed = {
        name: [
            light.position.tolist()
            for target in dataset.targets
            if target.occlusion == name
            for light in truths.get(target.name, ())
        ]
        for name in classes
    }
    seen = dataset.targets[0].views if dataset.targets else ()
    cameras = [camera_mark(view.camera) for view in dataset.train]
    if not cameras and not seen:
        return None
    figure = plan_figure(
        None if surfels is None else surfels.centers,
        None if surfels is None else surfels.normals,
        cameras,
        [light.position.tolist() for light in (*lamps, *(view.light for view in dataset.train)) if light is not None],
        {name: found for name, found in placed.items() if found},
        [camera_mark(view.camera) for view in seen],
        None if surfels is None else surfels.guessed,
    )
    return png_of(figure, dpi=120)
