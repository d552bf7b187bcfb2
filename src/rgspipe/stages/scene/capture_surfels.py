"""Find the albedo of the surfels and the lamps of photographs under which nobody knows where these were."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from rgspipe.capture.captured import Captured, capture_scenes
from rgspipe.capture.lamp_file import write_lamps
from rgspipe.capture.options import CaptureOptions
from rgspipe.capture.photographs import PixelsOfView
from rgspipe.capture.words import captured_words
from rgspipe.config.spoken import as_keys
from rgspipe.datasets.grade_file import GRADE, save_grade
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import LAMPS_TRUTH, dataset_root, open_dataset
from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.datasets.tensor_file import save_tensors
from rgspipe.datasets.views import View, as_photographed
from rgspipe.degradation.degraded_views import degraded
from rgspipe.evaluation.captured_lamps import against_truth
from rgspipe.evaluation.grading import grade_scene, graded_words
from rgspipe.evaluation.held_out import held_out_picture
from rgspipe.evaluation.held_out_views import HeldOut, render_held_out
from rgspipe.evaluation.images import save_png
from rgspipe.machine.description import PeakMemory
from rgspipe.options import settings
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.repainted import repainted
from rgspipe.scene.grade import SceneGrade
from rgspipe.stages.base import Stage, StageContext
from rgspipe.store.files import write_json
from rgspipe.training.albedo import ALBEDO_RANGE

#: Photographs that a scene is graded by.
MOST_JUDGED = 12

#: Settings that change how lamps are found, but not what is found.
NO_RESULT = ("memory_mib",)


def run(context: StageContext) -> None:
    """Write surfels.safetensors, doubt.safetensors, lamps.json, metrics.json, grade.json and comparison.png.

    Lamps of further lightings are lamps_2.json and so on. The picture is of views that were left out, if there are any
    whose lights are known.
    """
    memory, begin = PeakMemory(), time.perf_counter()
    folder = context.inputs["generate_dataset"].folder()
    dataset = open_dataset(folder, targets=False)
    start = load_surfels(context.inputs["init_depth"].file("surfels.safetensors"))
    views = degraded(dataset.train, context.config.capture)
    found, *others = capture_scenes(views, start, context.config.lamps, where=dataset.root)
    seconds = time.perf_counter() - begin
    save_surfels(context.folder / "surfels.safetensors", found.surfels)
    save_tensors(context.folder / "doubt.safetensors", {"log_albedo": found.doubt})
    for one in (found, *others):
        write_lamps(context.folder / (f"lamps_{one.lighting}.json" if one.lighting else "lamps.json"), one)
        words = as_keys(captured_words(one))
        print(f"Lighting {one.lighting}: {words}" if one.lighting else words)
    frozen = repainted(found.frozen, found.surfels)
    further = {one.lighting: _metrics(one) for one in others}
    metrics = (
        _metrics(found)
        | ({"others": further} if further else {})
        | _against_truth(found, dataset_root(folder) / LAMPS_TRUTH, dataset.train)
    )
    held_out = _held_out(frozen, dataset.test, context.folder)
    metrics |= {} if held_out is None else held_out.summary()
    own = [view for view in views if view.lighting == found.lighting]
    grade = _grade(frozen, found, own, held_out)
    print(graded_words(grade))
    save_grade(context.folder / GRADE, grade)
    metrics |= {"surfels": len(found.surfels), "seconds": seconds, "peak_memory_mib": memory.mib()}
    write_json(context.folder / "metrics.json", metrics)
    context.note(lamps=len(found.lamps), surfels=len(found.surfels), seconds=round(seconds, 3))


def _metrics(found: Captured) -> dict[str, Any]:
    """What is known of the answer without a truth."""
    variances, certainty = found.answer.best.problem.field.variances, found.certainty
    return {
        "words": as_keys(captured_words(found)),
        "lamps": {
            "number": len(found.lamps),
            "spread": certainty.spread(found.frozen.size).tolist(),
            "scale_error": certainty.scale,
            "bounced": certainty.bounced,
            "over_even_light": found.answer.over_even,
            "rivals": [
                {"places": one.tried.lamps.places.tolist(), "chance": one.chance} for one in found.answer.rivals
            ],
            "compared": [
                {"lamps": len(one.more.lamps), "gain": one.gain, "wanted": one.wanted} for one in found.answer.compared
            ],
        },
        "deviations": {name: math.sqrt(value) for name, value in vars(variances).items()},
        "albedo_doubt": float(found.doubt.median()),
        "oddities": asdict(found.oddities),
        "pixel_error": found.measured.error,
        "exposures": found.measured.cameras.gains.tolist(),
        "vignetting": found.measured.cameras.falloff.tolist(),
        "measured": float(np.mean(found.answer.best.problem.field.weight > 0.0)),
    }


def _against_truth(found: Captured, path: Path, views: Sequence[View]) -> dict[str, Any]:
    """How the lamps stand to those that are known to have been on, if they are."""
    if not path.exists():
        return {}
    truth, size = read_lights(path), found.frozen.size
    return {"truth": against_truth(found.lamps, found.certainty.places, truth, size, views)}


def _held_out(frozen: FrozenScene, views: Sequence[View], folder: Path) -> HeldOut | None:
    """Renders of the views that were left out, with a picture of them; None where none has a known light."""
    lit = [view for view in views if view.light is not None]
    if not lit:
        return None
    judged = render_held_out(frozen.surfels, lit, frozen.transport, 4, gather=frozen.gather)
    save_png(folder / "comparison.png", held_out_picture(judged.views, judged.images, judged.psnr, judged.albedo))
    return judged


def _grade(frozen: FrozenScene, found: Captured, views: Sequence[View], held_out: HeldOut | None) -> SceneGrade:
    """The scene's grade by views that were left out, or else by the photographs under the lamps that were found."""
    cameras = [view.camera for view in views]
    if held_out is None:
        chosen, psnr = range(0, len(views), math.ceil(len(views) / MOST_JUDGED)), None
        truths = [_evened(found, index, views[index]) for index in chosen]
        with torch.no_grad():
            renders = [frozen.render(views[index].camera, found.lamps) for index in chosen]
        saturated = [views[index].saturated for index in chosen]
        images = [as_photographed(*one) for one in zip(renders, truths, saturated, strict=True)]
    else:
        images, psnr = held_out.images, held_out.summary()["test_psnr_mean"]
        truths = [view.image for view in held_out.views]
    grade = grade_scene(frozen, images, truths, cameras=cameras, psnr=psnr, highest_albedo=ALBEDO_RANGE[1])
    return replace(grade, scale=float(found.certainty.scale))


def _evened(found: Captured, index: int, view: View) -> torch.Tensor:
    """(H, W, 3) what a photograph would show if all had one exposure, and corners were no darker."""
    light = found.measured.cameras.evened(index, PixelsOfView(view))
    return torch.from_numpy(light).float().reshape(view.image.shape)


STAGE = Stage(
    name="capture_surfels",
    help="finds albedo and lamps of photographs under lamps that nobody measured (scene.lamps=unknown)",
    run=run,
    inputs=lambda config: ["init_depth", "generate_dataset"],
    config_keys=(*(f"lamps.{key.name}" for key in settings(CaptureOptions) if key.name not in NO_RESULT), "capture"),
)
