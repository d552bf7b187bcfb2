"""What a fit leaves on disk for one target: its light file, its course, and pictures of it."""

from __future__ import annotations

import math
import shutil
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import torch
from torch import Tensor

from rgspipe.datasets.exr import write_image
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.evaluation.images import progress_strip, save_png, stack
from rgspipe.evaluation.metrics import psnr
from rgspipe.fitting.fit import FitViews, render_light
from rgspipe.fitting.result import FitResult, Step
from rgspipe.scene import PointLight

#: What the light file says beside the lights, and results.csv repeats.
FIELDS = ("loss", "iterations", "evaluations", "lights_tried", "seconds", "psnr", "result", "reason")

#: What an image that is equal to the last bit gets, so that the number can be written as JSON; float32 images that
#: differ at all stay below it.
BEST_PSNR = 200.0


def write_result(folder: Path, result: FitResult, views: FitViews, targets: Sequence[Tensor]) -> None:
    """Write lights.json, convergence.csv, fit.png and final.exr; `folder` appears when it is whole.

    fit.png has one row a view: target, start, midway, end, difference. final.exr is the first view's
    final image; those of further views are final_1.exr and so on.
    """
    partial = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    shown = [render_light(views, light) for light in _milestones(result)]
    final = shown[-1]
    _write_light_file(partial / "lights.json", result, _psnr(final, targets))
    _write_convergence(partial / "convergence.csv", result.trajectory)
    rows = [progress_strip(target, [images[k] for images in shown]) for k, target in enumerate(targets)]
    save_png(partial / "fit.png", stack(rows))
    for index, image in enumerate(final):
        write_image(partial / ("final.exr" if index == 0 else f"final_{index}.exr"), image.cpu().numpy())
    partial.rename(folder)


def read_result(folder: Path) -> dict[str, object]:
    """The row of results.csv of one target: x … b of its first light (empty without one) and `FIELDS`."""
    path = folder / "lights.json"
    content, lights = read_json(path, "a fit's light file"), read_lights(path)
    values = [*lights[0].position.tolist(), *lights[0].intensity.tolist()] if lights else [None] * 6
    return dict(zip("xyzrgb", values, strict=True)) | {name: content[name] for name in FIELDS}


def _milestones(result: FitResult) -> list[PointLight | None]:
    """The lights at the start, midway and at the end."""
    steps = result.trajectory
    if not steps or not result.lights:
        return [None, None, None]
    chosen = (steps[0], steps[len(steps) // 2])
    return [*(PointLight(step.position, step.intensity) for step in chosen), result.lights[0]]


def _psnr(images: Sequence[Tensor], targets: Sequence[Tensor]) -> float | None:
    """PSNR over all pixels of all views, at most BEST_PSNR; None where it has no meaning."""
    joined = [torch.cat([image.detach().reshape(-1, 1, 3).cpu() for image in group]) for group in (images, targets)]
    value = psnr(*joined)
    return None if math.isnan(value) else min(value, BEST_PSNR)


def _write_light_file(path: Path, result: FitResult, quality: float | None) -> None:
    extra = {
        "loss": result.loss,
        "iterations": result.iterations,
        "evaluations": result.evaluations,
        "lights_tried": result.lights_tried,
        "seconds": round(result.seconds, 4),
        "psnr": quality,
        "result": str(result.status),
        "reason": result.reason,
        "lights": [{"covariance": matrix.tolist()} for matrix in result.covariance],
    }
    write_lights(path, result.lights, extra)


def _write_convergence(path: Path, steps: Sequence[Step]) -> None:
    rows = [
        [index, step.loss, *step.position.tolist(), *step.intensity.tolist(), round(step.seconds, 4)]
        for index, step in enumerate(steps)
    ]
    pd.DataFrame(rows, columns=["step", "loss", *"xyzrgb", "seconds"]).to_csv(path, index=False)
