"""How far a setting's images are from path-traced truth, and what they cost."""

from __future__ import annotations

from dataclasses import asdict
from statistics import fmean

import pandas as pd

from rgspipe.benchmark.rooms import Room
from rgspipe.benchmark.settings import Model, RenderSetting, Workshop
from rgspipe.benchmark.step_cost import StepCost, step_cost
from rgspipe.benchmark.truth import KINDS, Truth
from rgspipe.progress import progress_bar


def image_errors(room: Room, truth: Truth, settings: list[RenderSetting], repetitions: int) -> pd.DataFrame:
    """One row a setting: the knobs, PSNR and relative error of direct and global images, and what they cost.

    Columns `direct_db`, `global_db` and with `_off_edges` are means over all cameras and lights, `_worst` the worst
    image; `global_relative` is the mean of ‖image − truth‖/‖truth‖. The truth's own noise does not count. Times are in
    milliseconds but for those in `_s`; `first_ms` is the time from surfels to the first image.
    """
    workshop = Workshop(room)
    rows = []
    for setting in progress_bar(settings, f"settings, {room.name}", unit="setting"):
        model = workshop.model(setting)
        cost = step_cost(model, room.lights[0], repetitions)
        rows.append({"room": room.name, "setting": setting.changed} | asdict(setting) | errors(model, room, truth))
        rows[-1] |= _cost_columns(model, cost)
    return pd.DataFrame(rows)


def errors(model: Model, room: Room, truth: Truth) -> dict[str, float]:
    """Error columns of one model."""
    found: dict[str, list[float]] = {}
    small = truth.pooled(model.setting.resolution)

    def add(name: str, value: float) -> None:
        found.setdefault(name, []).append(value)

    for camera, view in enumerate(model.views):
        away = ~view.edges.reshape(view.camera.height, view.camera.width)
        for light in range(len(room.lights)):
            for kind in KINDS:
                image = model.image(camera, room.rig(light), indirect=kind == "global")
                add(f"{kind}_db", small.psnr(image, camera, light, kind))
                add(f"{kind}_db_off_edges", small.psnr(image, camera, light, kind, away))
                add(f"{kind}_relative", small.relative_error(image, camera, light, kind))
    worst = {f"{name}_worst": min(found[name]) for name in ("direct_db", "global_db")}
    return {name: fmean(values) for name, values in found.items()} | worst


def _cost_columns(model: Model, cost: StepCost) -> dict[str, float]:
    parts = asdict(model.cost)
    first = 1e3 * model.cost.build_s + cost.forward_ms
    return parts | {"build_s": model.cost.build_s, "first_ms": first} | asdict(cost)
