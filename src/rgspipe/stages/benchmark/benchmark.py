"""Measure accuracy and time on this machine: the renderer against path-traced truth, the steps of a fit, or what the
numbers that steer a search are worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
import torch
from omegaconf import OmegaConf

from rgspipe.benchmark.fit_steps import fit_steps
from rgspipe.benchmark.renderer_report import REPORT, Bench, run_bench
from rgspipe.benchmark.rooms import ROOMS
from rgspipe.benchmark.search_settings import KnownTarget, rendered_spots, search_markdown, search_table
from rgspipe.benchmark.settings import RenderSetting
from rgspipe.benchmark.truth import load_truth
from rgspipe.config import RgspipeConfig, get_value
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.views import Target, View
from rgspipe.errors import InputError
from rgspipe.evaluation.metrics import longest_side
from rgspipe.evaluation.timing import load_average
from rgspipe.fitting import FitViews, LightSpec
from rgspipe.machine.description import machine
from rgspipe.machine.resources import resource_folder
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, LightRig, look_at
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.lights.fit_light import search_of
from rgspipe.stages.sources import require_images
from rgspipe.stages.targets.true_lights import scene_bounds, truth_file
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_json, write_text

#: The choices of `accuracy`.
PRESETS = ("draft", "standard", "reference")


def run(context: StageContext) -> None:
    """Write tables, and for the renderer figures and accuracy.md."""
    load = load_average()
    context.note(machine=machine(), load_average=load, threads=torch.get_num_threads())
    if load > 0.5:
        print(f"The load average is {load:.2f}: other programs run, and the times will be too long.")
    {"renderer": _renderer, "fit": _fit, "search": _search}[context.config.benchmark.kind](context)


def _renderer(context: StageContext) -> None:
    names = context.config.benchmark.rooms
    truths = [load_truth(artifact.folder() / name) for name, artifact in zip(names, _truths(context), strict=True)]
    rooms = tuple((ROOMS[name](), truth) for name, truth in zip(names, truths, strict=True))
    run_bench(Bench(rooms, context.config.benchmark.repetitions, preset_settings(), context.folder))
    print((context.folder / REPORT).read_text(encoding="utf-8"))


def preset_settings() -> dict[str, RenderSetting]:
    """The renderer's part of the presets `accuracy=draft|standard|reference`."""
    return {name: _preset(resource_folder("conf") / "accuracy" / f"{name}.yaml") for name in PRESETS}


def _preset(path: Path) -> RenderSetting:
    preset, schema = OmegaConf.load(path), RgspipeConfig()

    def value(key: str) -> Any:
        return OmegaConf.select(preset, key, default=get_value(schema, key))

    return RenderSetting(
        surfels=value("init.surfels"),
        gather_rays=value("freeze.gather_rays"),
        patches=value("freeze.patches"),
        supersampling=value("train.supersampling"),
        shadows="pixels" if value("effects.at_pixels") else "surfels",
    )


def _truths(context: StageContext) -> Sequence:
    return context.input_lists["render_truth"]


def _fit(context: StageContext) -> None:
    frozen = FrozenScene.load(context.inputs["freeze"].folder(), gather=True)
    position = 0.5 * (frozen.bounds[0] + frozen.bounds[1]) + 0.1 * frozen.size
    cameras = _camera(frozen, 128), _camera(frozen, 256)
    timings = fit_steps(frozen, *cameras, position.float(), context.config.benchmark.repetitions)
    table = pd.DataFrame([asdict(timing) for timing in timings])
    write_text(context.folder / "benchmark.csv", table.to_csv(index=False))
    context.note(surfels=len(frozen.surfels), gather_entries=frozen.gather.entries)
    write_json(context.folder / "benchmark.json", {"machine": machine(), "timings": table.to_dict("records")})
    print(table.to_string(index=False, float_format="%.2f"))


def _search(context: StageContext) -> None:
    """Write search.csv and search.md."""
    frozen = FrozenScene.load(context.inputs["freeze"].folder())
    dataset = context.inputs["generate_dataset"]
    bounds, _ = scene_bounds(dataset, context.inputs["freeze"])
    targets = _known_targets(context, frozen, dataset)
    config = context.config
    table = search_table(targets, longest_side(bounds), search_of(config.fit.search), config.benchmark.settings)
    write_text(context.folder / "search.csv", table.to_csv(index=False))
    text = search_markdown(table)
    write_text(context.folder / "search.md", text)
    context.note(targets=len(targets))
    print(text)


def _known_targets(context: StageContext, frozen: FrozenScene, dataset: Artifact) -> list[KnownTarget]:
    """Single lights in one view; two and three of them, added up, in all views and of unknown number; and spots."""
    config, wanted = context.config, context.config.benchmark.targets
    every = open_dataset(dataset.folder(), train=False, test=False).targets
    classes = {name: [one for one in every if one.occlusion == name][:wanted] for name in {t.occlusion for t in every}}
    singles = [target for name in sorted(classes) for target in classes[name]]
    sharp = config.effects.at_pixels

    def prepared(views: Sequence[View], spec: LightSpec) -> FitViews:
        cameras, masks = [view.camera for view in views], [view.alpha for view in views]
        return FitViews.prepare(frozen, cameras, lights=spec, masks=masks, sharp=sharp)

    def truth(target: Target) -> LightRig:
        return read_lights(truth_file(config, dataset, target.name))

    views = singles[0].views
    first, together = prepared(views[:1], LightSpec()), prepared(views, LightSpec(count=None))
    known = [KnownTarget([target.views[0].image], truth(target), first) for target in singles]
    for number in (2, 3):
        for start in range(wanted):
            # Every so many of the list: lights of different classes.
            parts = [singles[(start + step * len(singles) // number) % len(singles)] for step in range(number)]
            images = [sum(part.views[index].image for part in parts) for index in range(len(views))]
            known.append(KnownTarget(images, tuple(light for part in parts for light in truth(part)), together))
    return [*known, *rendered_spots(prepared(views, LightSpec("spot")), [truth(one)[0] for one in singles])]


def _camera(frozen: FrozenScene, resolution: int) -> Camera:
    """In front of the scene's open side (−y), as far as its whole width needs."""
    middle = 0.5 * (frozen.bounds[0] + frozen.bounds[1])
    origin = middle - 1.5 * frozen.size * torch.tensor([0.0, 1.0, 0.0])
    return Camera.from_field_of_view(look_at(origin, middle), 0.7, resolution, resolution)


def _inputs(config: RgspipeConfig) -> list[Need | str]:
    if config.benchmark.kind == "fit":
        return ["freeze"]
    if config.benchmark.kind == "search":
        require_images(config, "targets of its own, whose lights are known")
        return ["freeze", "generate_dataset"]
    if config.scene.kind == "ply":
        raise InputError(
            "stage=benchmark",
            expected="benchmark=fit with scene=ply, which times the steps of a fit on its surfels",
            found="benchmark.kind=renderer, which measures rooms of its own that Blender path-traces",
            remedy="Add benchmark=fit, or leave scene=ply away.",
        )
    return [Need("render_truth", {"benchmark.rooms": [name]}) for name in config.benchmark.rooms]


def _keys(config: RgspipeConfig) -> tuple[str, ...]:
    if config.benchmark.kind == "fit":
        return ("benchmark.kind", "benchmark.repetitions")
    if config.benchmark.kind == "search":
        return ("benchmark.kind", "benchmark.targets", "benchmark.settings", "fit.search", "effects.at_pixels")
    return ("benchmark",)


STAGE = Stage(
    name="benchmark",
    help="measures accuracy and time on this machine",
    run=run,
    inputs=_inputs,
    config_keys=_keys,
)
