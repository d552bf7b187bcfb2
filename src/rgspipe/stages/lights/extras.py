"""What fit_light writes beside the lights where it is asked to: advice on further views, and the loss around them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd
import torch
from torch import Tensor

from rgspipe.config.fit import FitConfig
from rgspipe.datasets.advice_file import ADVICE, ALONE, IN_ORDER, PLAN, SUGGESTED
from rgspipe.datasets.frames import FrameEntry, read_entries
from rgspipe.datasets.json_file import numbers
from rgspipe.datasets.landscape_file import Landscape, PlaneLoss, landscape_bytes
from rgspipe.datasets.location import dataset_root
from rgspipe.fitting import FitResult, FitViews
from rgspipe.fitting.certainty.advice import ViewAdvice, suggest_views
from rgspipe.fitting.certainty.landscape import loss_slices
from rgspipe.fitting.in_sight.lamp import left_out
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.scene import Camera

#: A camera and its name.
Named = tuple[str, Camera]


def further_files(
    config: FitConfig,
    views: FitViews,
    images: Sequence[Tensor],
    result: FitResult,
    candidates: Sequence[Named],
    capture: ImageCapture,
) -> dict[str, bytes]:
    """The files that the configuration asks for, by name; none for a fit without lights.

    Args:
        images: (H, W, 3) per view, as they were taken.
        candidates: cameras that could be added.
        capture: how the images were taken.
    """
    files: dict[str, bytes] = {}
    if not result.lights:
        return files
    if config.suggest_view:
        present = [view.camera for view in views.prepared.views]
        advice = suggest_views(
            views.prepared.frozen,
            result,
            present,
            [camera for _, camera in candidates],
            wanted=config.wanted_accuracy,
            effects=views.effects,
            capture=capture,
            certainty=config.search.certainty,
        )
        names = [name for name, _ in candidates]
        files[SUGGESTED] = _advice_table(advice, names).to_csv(index=False).encode()
        files[ADVICE] = _advice_words(advice, names)
    if config.landscape:
        files["landscape.npz"] = _landscape(views, images, result, capture)
    return files


def training_cameras(dataset: Path | None, like: Camera) -> list[Named]:
    """The cameras of the training views, named by their images; `like` has the size where nothing tells it."""
    if dataset is None:
        return []
    path = dataset_root(dataset) / "transforms_train.json"
    if not path.exists():
        return []
    entries = read_entries(path, "the cameras of the training views")
    return [(f"train/{entry.image_path.stem}", entry.camera(*_size(entry, like))) for entry in entries]


def _size(entry: FrameEntry, like: Camera) -> tuple[int, int]:
    """Width and height of a training image: as the file says, or twice its principal point, or like `like`."""
    stated = entry.shared | entry.fields
    middle = [0.5 * like.width, 0.5 * like.height]
    if "camera_intrinsics" in stated:
        middle = numbers(stated["camera_intrinsics"], 4, entry.where, "camera_intrinsics")[:2]
    width, height = (round(2.0 * half) for half in middle)
    return int(stated.get("w", width)), int(stated.get("h", height))


def _advice_table(advice: ViewAdvice, names: Sequence[str]) -> pd.DataFrame:
    """One row a camera that is added alone ("alone"), then those of the plan ("plan"), best first.

    Then the candidates as they are listed, each added to those before it ("in_order"): the target's own come first.
    """
    present = advice.present_views
    rows = [(ALONE, present + 1, names[view.camera], view.position_sd) for view in advice.ranked]
    for added, views in ((PLAN, advice.plan), (IN_ORDER, advice.in_order)):
        together = enumerate(views, start=present + 1)
        rows += [(added, count, names[view.camera], view.position_sd) for count, view in together]
    return pd.DataFrame(rows, columns=["added", "views", "camera", "position_sd"])


def _advice_words(advice: ViewAdvice, names: Sequence[str]) -> bytes:
    numbers = {"present_sd": advice.present_sd, "wanted": advice.wanted}
    content = {name: value if value < float("inf") else "inf" for name, value in numbers.items()}
    content |= {"present_views": advice.present_views, "views_needed": advice.views_needed}
    return (json.dumps(content | {"words": advice.words(names)}, indent=1, allow_nan=False) + "\n").encode()


def _landscape(views: FitViews, images: Sequence[Tensor], result: FitResult, capture: ImageCapture) -> bytes:
    """The loss around the first light, with the exposures that were found, of the pixels that were fitted."""
    if result.lamps:
        views = views.without(left_out(result.lamps, [image.shape[:2] for image in images]))
    known = replace(capture, exposure_free=False)
    problem = views.problem(views.prepared.stack_images(images), known)
    if result.exposures:
        problem = problem.with_exposures(torch.tensor(result.exposures, dtype=torch.float64))
    pairs = zip(result.lights, result.covariance, strict=True)
    rig = [Emitter.fitted(light, matrix) for light, matrix in pairs]
    planes = {
        "".join("xyz"[k] for k in one.axes): PlaneLoss(one.across.numpy(), one.up.numpy(), one.loss.numpy())
        for one in loss_slices(problem, rig)
    }
    path = torch.stack([step.position.double().cpu() for step in result.trajectory if step.lights])
    return landscape_bytes(Landscape(planes, path.numpy()))
