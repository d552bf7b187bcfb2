"""Studies of courses: how methods get from their start to their answer, on a few targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import torch

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.read_files import files_read
from rgspipe.datasets.views import View
from rgspipe.evaluation.classes import class_of
from rgspipe.evaluation.markdown import markdown_table
from rgspipe.evaluation.metrics import longest_side
from rgspipe.evaluation.plots import png_of
from rgspipe.fitting import FitViews
from rgspipe.progress import progress_bar
from rgspipe.scene import LightRig
from rgspipe.stages.base import Need, StageContext
from rgspipe.stages.lights import fit_light
from rgspipe.stages.lights.capture import captured_views
from rgspipe.stages.lights.fit_light import Fitter
from rgspipe.stages.lights.targets import used_views
from rgspipe.stages.sources import target_stage
from rgspipe.stages.studies.cases import target_limit
from rgspipe.stages.studies.kind import StudyKind
from rgspipe.stages.targets.true_lights import scene_bounds, truth_file
from rgspipe.store.artifacts import Artifact
from rgspipe.studies.course_figure import course_figure, courses_figure
from rgspipe.studies.courses import CourseStep, course_of, course_summary, course_table
from rgspipe.studies.written import Study

#: What stands beside the table, which has a row a fit: a row a step, and a picture a target.
COURSES, PICTURES = "courses.csv", "pictures"

#: What study.md shows of study.csv: headings and formats.
SHOWN = {
    "target": ("target", ""),
    "occlusion": ("light", ""),
    "method": ("method", ""),
    "steps": ("steps", ""),
    "seconds": ("time (s)", ".2f"),
    "seconds_to_limit": ("solved after (s)", ".2f"),
    "position_error_start": ("position error: start", ".2%"),
    "position_error_end": ("end", ".2%"),
    "intensity_error_start": ("intensity error: start", ".2%"),
    "intensity_error_end": ("end", ".2%"),
    "image_error_start": ("image error: start", ".2%"),
    "image_error_end": ("end", ".2%"),
}


def _gather(context: StageContext) -> Study:
    """The summary of all courses, with the courses themselves and a picture of each target beside it."""
    config, fits = context.config, context.input_lists["fit_light"]
    dataset = next((context.inputs.get(stage) for stage in target_stage(config)), None)
    bounds, _ = scene_bounds(dataset, context.inputs["freeze"])
    size = math.nan if bounds is None else longest_side(bounds)
    fitter = Fitter.create(context)
    results = pd.read_csv(fits[0].file("results.csv"), dtype={"target": str})
    parts: list[pd.DataFrame] = []
    pictures: dict[str, bytes] = {}
    for row in progress_bar(results.to_dict("records"), "comparing courses", unit="target"):
        name, path = row["target"], truth_file(config, dataset, row["target"])
        truth = () if path is None else read_lights(path)
        views, prepared = _views(fitter, _target_folder(config, dataset, name), name)
        courses = _courses(fits, config.study.methods, name, truth, size, views, prepared)
        courses.insert(0, "target", name)
        courses.insert(1, "occlusion", class_of(row["occlusion"], len(truth)))
        surfels, origins = prepared.prepared.frozen.surfels, torch.stack([view.camera.origin for view in views])
        figure = course_figure(courses, truth, surfels.centers, surfels.normals, origins)
        pictures[f"{PICTURES}/{name}.png"] = png_of(figure, dpi=130)
        parts.append(courses)
    joined = pd.concat(parts, ignore_index=True)
    table = course_summary(joined, config.evaluate.success)
    table.insert(0, "scene", config.scene.folder)
    beside = {COURSES: joined.to_csv(index=False).encode()} | pictures
    return Study(table, markdown_table(table, SHOWN), courses_figure(joined), beside)


def _target_folder(config: RgspipeConfig, dataset: Artifact | None, name: str) -> Path:
    if config.fit.target is not None:
        return Path(config.fit.target)
    assert dataset is not None
    return dataset_root(dataset.folder()) / "targets" / name


def _views(fitter: Fitter, folder: Path, name: str) -> tuple[list[View], FitViews]:
    views, _ = captured_views(used_views(load_target(folder), fitter.config), name, fitter.config)
    return views, fitter.prepare(views)


def _courses(
    fits: Sequence[Artifact],
    methods: Sequence[str],
    name: str,
    truth: LightRig,
    size: float,
    views: list[View],
    prepared: FitViews,
) -> pd.DataFrame:
    """The courses of all methods on one target, one below the other."""
    parts = []
    for method, fit in zip(methods, fits, strict=True):
        path = fit.file(f"{name}/lights.json")
        exposures = read_json(path, "a fit's light file")["exposures"] or [1.0] * len(views)
        curve = pd.read_csv(fit.file(f"{name}/convergence.csv"))
        steps = course_of(curve, read_lights(path))
        if not steps:
            continue
        course = course_table(steps, truth, size)
        images = [view.image / exposure for view, exposure in zip(views, exposures, strict=True)]
        course["image_error"] = [_image_error(prepared, one, images) for one in steps]
        course.insert(0, "method", method)
        parts.append(course)
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=["method", "step", "seconds"])


def _image_error(prepared: FitViews, step: CourseStep, images: list[torch.Tensor]) -> float:
    """Σ (C − C*)² / Σ C*² over all pixels of all views: the same measure for every method."""
    pairs = list(zip(prepared.render(step.rig), images, strict=True))
    squared = sum(float((image.cpu() - target.to(image.dtype)).double().square().sum()) for image, target in pairs)
    return squared / sum(float(target.double().square().sum()) for _, target in pairs)


def _inputs(config: RgspipeConfig) -> list[Need | str]:
    changes = {"fit.limit": target_limit(config)}
    fits = [Need("fit_light", {"fit.method": method} | changes) for method in config.study.methods]
    return [*fits, *target_stage(config), "freeze"]


def _keys(config: RgspipeConfig) -> list[str]:
    return [*fit_light.STAGE.keys(config), "study", "evaluate.success", "fit.truth"]


def _files(config: RgspipeConfig) -> list[Path]:
    """The user's own target and its truth."""
    target = [] if config.fit.target is None else files_read(config.fit.target)
    return target if config.fit.truth is None else [*target, Path(config.fit.truth)]


KIND = StudyKind(inputs=_inputs, gather=_gather, keys=_keys, files=_files)
