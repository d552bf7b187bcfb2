"""Compare recovered lights with the truth: errors per target and per occlusion class."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.landscape_file import read_landscape
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import dataset_root
from rgspipe.evaluation import convergence, metrics, plots
from rgspipe.evaluation.landscape_plot import landscape_figure
from rgspipe.evaluation.rig_errors import nearest_position
from rgspipe.evaluation.summary import summary_table
from rgspipe.evaluation.tables import exemplars, target_table
from rgspipe.scene import Camera, LightRig, PointLight
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.evaluation.noise import noise_bounds
from rgspipe.stages.lights.targets import view_keys
from rgspipe.stages.sources import target_stage
from rgspipe.stages.targets.true_lights import scene_bounds, truth_file
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_bytes, write_json, write_text
from rgspipe.store.strict_json import as_json


@dataclass(frozen=True)
class _Truth:
    """What is known beside the fit: true rigs by target, the scene's box, and what is missing, in words."""

    rigs: Mapping[str, LightRig]
    bounds: list[list[float]] | None
    notes: list[str]


def run(context: StageContext) -> None:
    """Write metrics.csv, summary.csv, convergence.csv, metrics.json and pictures/ of typical and worst targets."""
    fit, config = context.inputs["fit_light"], context.config
    results = pd.read_csv(fit.file("results.csv"), dtype={"target": str, "result": str, "reason": str})
    estimates = {row["target"]: _estimate(fit, row) for row in results.to_dict("records")}
    dataset = next((context.inputs.get(stage) for stage in target_stage(config)), None)
    freeze = context.inputs.get("freeze")
    truth = _truth(config, dataset, freeze, list(estimates))
    size = math.nan if truth.bounds is None else metrics.longest_side(truth.bounds)

    covariances = {name: _covariances(fit, name) for name in estimates}
    bounds = noise_bounds(context, truth.rigs)
    targets = target_table(results, estimates, truth.rigs, size, config.evaluate.success, covariances, bounds)
    summary = summary_table(targets, config.seed)
    write_text(context.folder / "metrics.csv", targets.to_csv(index=False))
    write_text(context.folder / "summary.csv", summary.to_csv(index=False))
    curves = _curves(fit, targets, estimates, truth.rigs, size)
    write_text(context.folder / "convergence.csv", curves.to_csv(index=False))
    content = {
        "version": 1,
        "scene_size": size,
        "bounds": truth.bounds,
        "success_limit": config.evaluate.success,
        "sought": {"number": config.light.count is None, "types": config.light.type == "auto"},
        "summary": summary.to_dict("records"),
        "cameras": _cameras(config, dataset, targets),
        "pictures": [
            *_copy_pictures(fit, targets, context.folder),
            *_draw_landscapes(fit, targets, truth.rigs, context.folder),
        ],
        "notes": truth.notes,
    }
    write_json(context.folder / "metrics.json", as_json(content))
    context.note(targets=len(targets), with_truth=int(targets["position_error"].notna().sum()))


def _estimate(fit: Artifact, row: Mapping[str, Any]) -> LightRig:
    """The recovered rig of a target: its light file, or else the one light of its row; empty if the fit failed."""
    name = f"{row['target']}/lights.json"
    if name in fit.manifest["files"]:
        return read_lights(fit.file(name))
    values = torch.tensor([float(row.get(key, math.nan)) for key in "xyzrgb"], dtype=torch.float64)
    return (PointLight(values[:3], values[3:]),) if bool(torch.isfinite(values).all()) else ()


def _covariances(fit: Artifact, target: str) -> tuple[torch.Tensor, ...]:
    """How sure the fit is of each light of a target; empty where it does not say."""
    name = f"{target}/lights.json"
    return read_covariances(fit.file(name)) if name in fit.manifest["files"] else ()


def _truth(config: RgspipeConfig, dataset: Artifact | None, freeze: Artifact | None, names: list[str]) -> _Truth:
    files = {name: truth_file(config, dataset, name) for name in names}
    rigs = {name: read_lights(path) for name, path in files.items() if path is not None}
    bounds, note = scene_bounds(dataset, freeze)
    unknown = [name for name in names if not rigs.get(name)]
    notes = [note] if note else []
    if unknown:
        shown = ", ".join(unknown[:5]) + (", …" if len(unknown) > 5 else "")
        notes.append(f"No true lights are known for {len(unknown)} of {len(names)} targets ({shown}): no errors there.")
    return _Truth(rigs, bounds, notes)


def _curves(
    fit: Artifact,
    targets: pd.DataFrame,
    estimates: Mapping[str, LightRig],
    truths: Mapping[str, LightRig],
    size: float,
) -> pd.DataFrame:
    parts = []
    for row in targets.to_dict("records"):
        name = f"{row['target']}/convergence.csv"
        if name in fit.manifest["files"]:
            curve = pd.read_csv(fit.file(name))
            found, truth = estimates[row["target"]], truths.get(row["target"], ())
            parts.append(convergence.convergence_table(curve, row, found, truth, size))
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(convergence.COLUMNS))


def _copy_pictures(fit: Artifact, targets: pd.DataFrame, folder: Path) -> list[dict[str, Any]]:
    """Copy the fit pictures of each class's median and worst target, so that a report needs no fit folder."""
    rows = targets.set_index("target")
    pictures = []
    for occlusion, chosen in exemplars(targets).items():
        for kind, target in chosen.items():
            source = f"{target}/fit.png"
            if source not in fit.manifest["files"]:
                continue
            name = f"pictures/{occlusion}_{kind}.png"
            write_bytes(folder / name, fit.file(source).read_bytes())
            measured = {key: float(rows.loc[target, key]) for key in ("position_error", "psnr")}
            pictures.append({"file": name, "target": target, "occlusion": occlusion, "kind": kind} | measured)
    return pictures


def _draw_landscapes(
    fit: Artifact, targets: pd.DataFrame, truths: Mapping[str, LightRig], folder: Path
) -> list[dict[str, Any]]:
    """Draw the loss around the lights of each class's median and worst target, where the fit has worked it out."""
    pictures = []
    for occlusion, chosen in exemplars(targets).items():
        for kind, target in chosen.items():
            source = f"{target}/landscape.npz"
            if source not in fit.manifest["files"]:
                continue
            landscape, rig = read_landscape(fit.file(source)), truths.get(target, ())
            truth = nearest_position(landscape.trajectory[-1], rig)
            name = f"pictures/{occlusion}_{kind}_landscape.png"
            write_bytes(folder / name, plots.png_of(landscape_figure(landscape, truth)))
            unmeasured = {"position_error": None, "psnr": None}
            entry = {"file": name, "target": target, "occlusion": occlusion, "kind": "landscape"}
            pictures.append(entry | unmeasured)
    return pictures


def _cameras(config: RgspipeConfig, dataset: Artifact | None, targets: pd.DataFrame) -> list[dict[str, Any]]:
    """The cameras of the first target that the fit used: all targets of a dataset are seen by the same ones."""
    if config.fit.target is not None:
        folder = Path(config.fit.target)
    elif dataset is not None and len(targets):
        folder = dataset_root(dataset.path) / "targets" / targets["target"].iloc[0]
    else:
        return []
    views = load_target(folder).views
    indices = config.views.indices if config.views.indices is not None else range(config.views.count)
    return [_camera(views[index].camera) for index in indices if index < len(views)]


def _camera(camera: Camera) -> dict[str, Any]:
    return {
        "origin": camera.origin.tolist(),
        "direction": (-camera.camera_to_world[:3, 2]).tolist(),
        "angle": 2.0 * math.atan(0.5 * camera.width / camera.fx),
    }


def _truth_file(config: RgspipeConfig) -> list[Path]:
    """The true lights that are given, read now: what is wrong with them should show before lights are fitted."""
    if config.fit.target is None or config.fit.truth is None:
        return []
    read_lights(config.fit.truth)
    return [Path(config.fit.truth)]


def _keys(config: RgspipeConfig) -> list[str]:
    keys = ["evaluate", "seed", "fit.target", "light.type", "light.count", "target_capture.noise", *view_keys(config)]
    return keys if config.fit.target is None else [*keys, "fit.truth"]


STAGE = Stage(
    name="evaluate",
    help="errors of the recovered lights per target and per class",
    inputs=lambda config: ["fit_light", *target_stage(config), "freeze"],
    config_keys=_keys,
    files=_truth_file,
    run=run,
)
