"""Fit the surfels' materials and geometry to the training images, and judge them on held-out ones."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from rgspipe.config.train import TrainConfig
from rgspipe.datasets.grade_file import GRADE, save_grade
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_views import degraded
from rgspipe.evaluation.grading import grade_scene, graded_words
from rgspipe.evaluation.held_out import held_out_picture
from rgspipe.evaluation.held_out_views import render_held_out
from rgspipe.evaluation.images import save_png
from rgspipe.machine.description import PeakMemory
from rgspipe.options import settings
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.grade import SceneGrade
from rgspipe.stages.base import Stage, StageContext
from rgspipe.store.files import write_json, write_text
from rgspipe.training.albedo import ALBEDO_RANGE
from rgspipe.training.checkpoint import Checkpoint
from rgspipe.training.light_refinement import log_gains
from rgspipe.training.materials import build_frozen, fit_materials
from rgspipe.training.operator_store import OperatorStore
from rgspipe.training.options import TrainOptions
from rgspipe.training.prior import prior_from_maps
from rgspipe.training.trainer import Trained, train

#: Views that a scene is graded by where none was left out of training.
MOST_JUDGED = 12

#: Settings that a training can be resumed with another value of: they do not change the surfels.
NO_RESULT = ("memory_mib", "scratch", "checkpoint_every")


def run(context: StageContext) -> None:
    """Write surfels.safetensors, training.csv, metrics.json and, where views are left out, comparison.png."""
    memory, config = PeakMemory(), context.config.train
    options = replace(config, scratch=config.scratch or context.scratch)
    dataset = open_dataset(context.inputs["generate_dataset"].folder(), targets=False)
    start = load_surfels(context.inputs["init_depth"].file("surfels.safetensors"))
    checkpoint = Checkpoint(context.scratch / "checkpoint.safetensors", config.checkpoint_every)
    train_views = degraded(dataset.train, context.config.capture)
    known = prior_from_maps(train_views, config.albedo_prior_weight) if config.albedo_prior == "dataset" else None
    trained = train(train_views, start, options, checkpoint=checkpoint, prior=known, device=context.device)
    save_surfels(context.folder / "surfels.safetensors", trained.surfels)
    _write_table(context.folder / "training.csv", trained)

    seconds = {"training": trained.records[-1].seconds}
    began = time.perf_counter()
    metrics, grade = _judged(trained, dataset.test, options, context.folder)
    seconds["held_out"] = time.perf_counter() - began
    print(_quality(metrics))
    print(graded_words(grade))
    save_grade(context.folder / GRADE, grade)
    metrics |= {"surfels": len(trained.surfels), "seconds": seconds["training"]}
    if config.direct_only and dataset.test:
        metrics["direct_only_psnr"] = _direct_only(trained, train_views, dataset.test, options)
    metrics["peak_memory_mib"] = memory.mib()
    metrics["operators_mib"] = trained.stored.mib()
    if trained.surfels.gloss is not None:
        metrics["gloss"] = _gloss(trained.surfels.gloss)
    if options.light_rounds > 0:
        metrics["lights"] = _corrections(train_views, trained.views)
    write_json(context.folder / "metrics.json", metrics)
    context.note(
        test_psnr_mean=metrics.get("test_psnr_mean"),
        surfels=len(trained.surfels),
        seconds={name: round(value, 3) for name, value in seconds.items()},
    )


def _judged(
    trained: Trained, left_out: tuple[View, ...], options: TrainOptions, folder: Path
) -> tuple[dict[str, Any], SceneGrade]:
    """Measures of the views that training never saw, with a picture of them in `folder`; and the scene's grade.

    Where no view was left out there are no measures, and the grade is of views that the scene was trained on.
    """
    frozen = build_frozen(trained.surfels, options)
    views = left_out or trained.views[:: math.ceil(len(trained.views) / MOST_JUDGED)]
    judged = render_held_out(
        trained.surfels,
        views,
        frozen.transport,
        options.supersampling,
        options.at_pixels,
        OperatorStore.of(options),
        frozen.gather,
    )
    summary = judged.summary() if left_out else {}
    truths = [view.image for view in judged.views]
    cameras = [view.camera for view in trained.views]
    psnr = summary.get("test_psnr_mean")
    grade = grade_scene(frozen, judged.images, truths, cameras=cameras, psnr=psnr, highest_albedo=ALBEDO_RANGE[1])
    if not left_out:
        return summary, grade
    picture = held_out_picture(judged.views, judged.images, judged.psnr, judged.albedo)
    save_png(folder / "comparison.png", picture)
    return summary, grade


def _quality(metrics: dict[str, Any]) -> str:
    """One line on how well the scene renders what it was not trained on."""
    if "per_view" not in metrics:
        return "training: no view was left out of it (transforms_test.json): the scene is graded by views that it knows"
    rows = [row for row in metrics["per_view"] if row["psnr"] is not None]
    if not rows:
        return "training: no PSNR, as the views that were left out are black"
    worst = min(rows, key=lambda row: row["psnr"])
    mean = sum(row["psnr"] for row in rows) / len(rows)
    shown = f"{worst['psnr']:.1f} dB in the worst ({worst['name']})"
    return f"training: PSNR {mean:.1f} dB on {len(rows)} views that were left out, {shown}"


def _direct_only(
    trained: Trained, train_views: tuple[View, ...], test_views: tuple[View, ...], options: TrainOptions
) -> float | None:
    """Mean held-out PSNR of the same geometry when light does not bounce, its albedo fitted accordingly."""
    there = [view.to(trained.surfels.centers.device) for view in train_views]
    surfels = fit_materials(trained.surfels, there, options, bounces=False).surfels
    held_out = render_held_out(
        surfels, test_views, None, options.supersampling, options.at_pixels, OperatorStore.of(options)
    )
    return held_out.summary()["test_psnr_mean"]


def _gloss(gloss: Gloss) -> dict[str, float]:
    """How many surfels are glossy, and the medians of what they are like."""
    chosen = gloss.glossy
    return {
        "surfels": len(chosen),
        "reflectance": float(gloss.reflectance[chosen].mean(dim=1).median()),
        "exponent": float(gloss.exponents[chosen].median()),
    }


def _corrections(measured: Sequence[View], refined: Sequence[View]) -> dict[str, float]:
    """How far training lights were moved, scene units, and their intensities changed: root mean squares."""
    lights = [(a.light, b.light) for a, b in zip(measured, refined, strict=True)]
    moved = torch.stack([b.position - a.position for a, b in lights]).norm(dim=1)
    gain = log_gains([b for _, b in lights], [a for a, _ in lights])
    return {
        "position_rms": float(moved.square().mean().sqrt()),
        "log_intensity_rms": float(gain.square().nanmean().sqrt()),
    }


def _write_table(path: Path, trained: Trained) -> None:
    rows = [asdict(record) for record in trained.records]
    table = pd.DataFrame(rows).rename(columns={"phase": "kind", "step": "round"})
    write_text(path, table[["round", "kind", "loss", "psnr", "seconds"]].to_csv(index=False))


STAGE = Stage(
    name="train_surfels",
    help="fits materials and geometry of the surfels to the training images",
    run=run,
    inputs=lambda config: ["init_depth", "generate_dataset"],
    config_keys=(*(f"train.{key.name}" for key in settings(TrainConfig) if key.name not in NO_RESULT), "capture"),
)
