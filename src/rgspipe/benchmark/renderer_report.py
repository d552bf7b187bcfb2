"""The renderer's benchmark: every table and figure of what its accuracy costs, in one run."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import pandas as pd

from rgspipe.benchmark import tables
from rgspipe.benchmark.effect_savings import effect_savings
from rgspipe.benchmark.effect_scenes import EFFECT_SCENES
from rgspipe.benchmark.figures import front_figure, scaling_figure
from rgspipe.benchmark.fit_steps import fit_steps
from rgspipe.benchmark.front import mark_front, over_rooms
from rgspipe.benchmark.gather_quality import compare_gathers
from rgspipe.benchmark.image_error import image_errors
from rgspipe.benchmark.light_bias import light_biases
from rgspipe.benchmark.mitsuba_peer import mitsuba_rows
from rgspipe.benchmark.ray_rate import memory_traffic, ray_rates
from rgspipe.benchmark.rooms import Room
from rgspipe.benchmark.scaling import scaling
from rgspipe.benchmark.settings import RenderSetting, Workshop, sweep
from rgspipe.benchmark.truth import Truth
from rgspipe.evaluation.plots import png_of, svg_bytes
from rgspipe.evaluation.timing import load_average
from rgspipe.store.files import write_bytes, write_json, write_text
from rgspipe.store.whole_files import WholeFiles

#: Surfels of the comparison of gather operators, whose reference has thousands of rays a surfel.
GATHER_SURFELS, GATHER_RAYS = 2_500, (32, 128, 512)

#: Rigs of each scene of the comparison of effects, and its tolerance.
EFFECT_RIGS, TOLERANCE = 16, 1e-3

#: Where the figures and tables are.
REPORT = "accuracy.md"


@dataclass(frozen=True)
class Bench:
    """What is measured on.

    Attributes:
        rooms: with their truth; the first one stands for all where one is enough.
        repetitions: of each timing.
        presets: the settings of the accuracy presets, by name.
        folder: receives a CSV file per part; parts that are there already are not measured again.
    """

    rooms: tuple[tuple[Room, Truth], ...]
    repetitions: int
    presets: Mapping[str, RenderSetting]
    folder: Path


def run_bench(bench: Bench) -> None:
    """Measure every part that is missing, then write the figures and accuracy.md."""
    measured = {name: _part(bench, name, measure) for name, measure in PARTS.items()}
    front = mark_front(over_rooms(_of_one_size(measured["error"])), time="step_ms", error="global_relative")
    peers = over_rooms(measured["peers"].assign(setting=measured["peers"]["spp"].astype(str))).assign(
        renderer=measured["peers"]["renderer"].iloc[0]
    )
    figures = {
        "front": front_figure(front, peers, error="global_relative"),
        "scaling": scaling_figure(measured["scaling"]),
    }
    for name, figure in figures.items():
        write_bytes(bench.folder / f"{name}.svg", svg_bytes(figure))
        write_bytes(bench.folder / f"{name}.png", png_of(figure))
    write_text(bench.folder / "front.csv", front.to_csv(index=False))
    loads = {name: json.loads(_load_path(bench, name).read_text())["load_average"] for name in PARTS}
    write_text(bench.folder / REPORT, tables.report(measured, front, loads, bench.presets))


def _of_one_size(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of the standard resolution: errors of smaller images cannot be compared with theirs."""
    return rows[rows["resolution"] == RenderSetting().resolution]


def _part(bench: Bench, name: str, measure: Callable[[Bench], pd.DataFrame]) -> pd.DataFrame:
    path, beside = bench.folder / f"{name}.csv", _load_path(bench, name)
    whole = WholeFiles(bench.folder)
    if not whole.keeps(path, beside):
        load = load_average()
        write_text(path, measure(bench).to_csv(index=False))
        write_json(beside, {"load_average": round(load, 2)})
        whole.add(path, beside)
    return pd.read_csv(path)


def _load_path(bench: Bench, name: str) -> Path:
    return bench.folder / f"{name}.load.json"


def _error(bench: Bench) -> pd.DataFrame:
    parts = [image_errors(room, truth, sweep(bench.presets.values()), bench.repetitions) for room, truth in bench.rooms]
    return pd.concat(parts, ignore_index=True)


def _bias(bench: Bench) -> pd.DataFrame:
    settings = [RenderSetting(), replace(RenderSetting(), shadows="pixels"), *bench.presets.values()]
    parts = []
    for room, truth in bench.rooms:
        workshop = Workshop(room)
        parts += [light_biases(room, truth, workshop.model(setting)) for setting in dict.fromkeys(settings)]
    return pd.concat(parts, ignore_index=True)


def _steps(bench: Bench) -> pd.DataFrame:
    room = bench.rooms[0][0]
    model = Workshop(room).model(RenderSetting())
    small, large = room.cameras(128)[0], room.cameras(256)[0]
    timings = fit_steps(model.frozen, small, large, room.lights[0].float(), bench.repetitions)
    return pd.DataFrame([asdict(timing) for timing in timings])


def _rays(bench: Bench) -> pd.DataFrame:
    room = bench.rooms[0][0]
    model = Workshop(room).model(RenderSetting())
    return ray_rates(model.frozen.surfels, room.lights.float(), room.cameras(256)[0], bench.repetitions)


def _traffic(bench: Bench) -> pd.DataFrame:
    room = bench.rooms[0][0]
    model = Workshop(room).model(RenderSetting())
    frozen = model.frozen
    operators = {"view weights, 128²": model.views[0].operator, "gather from patches": frozen.transport.gather}
    return memory_traffic(operators | {"full gather": frozen.gather}, 3, bench.repetitions)


def _gather(bench: Bench) -> pd.DataFrame:
    room = bench.rooms[0][0]
    surfels = Workshop(room).model(replace(RenderSetting(), surfels=GATHER_SURFELS)).frozen.surfels
    return compare_gathers(room, surfels, rays=GATHER_RAYS)


def _effects(bench: Bench) -> pd.DataFrame:
    return effect_savings(list(EFFECT_SCENES.values()), EFFECT_RIGS, TOLERANCE)


def _peers(bench: Bench) -> pd.DataFrame:
    parts = []
    for room, truth in bench.rooms:
        model = Workshop(room).model(RenderSetting(resolution=truth.resolution))
        away = [~view.edges.reshape(truth.resolution, truth.resolution) for view in model.views]
        parts.append(mitsuba_rows(room, truth, bench.repetitions, away=away))
    return pd.concat(parts, ignore_index=True)


#: What is measured, in the order in which it stands in the report.
PARTS: Mapping[str, Callable[[Bench], pd.DataFrame]] = {
    "steps": _steps,
    "error": _error,
    "bias": _bias,
    "scaling": lambda bench: scaling(bench.rooms[0][0]),
    "rays": _rays,
    "traffic": _traffic,
    "gather": _gather,
    "effects": _effects,
    "peers": _peers,
}
