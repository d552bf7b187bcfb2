"""What a run that looked for lights found, in a few lines: the lights of few targets, a table over many."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from rgspipe.cli.cells import decibels, degrees, percent, seconds, time, words
from rgspipe.cli.columns import columns, without_empty
from rgspipe.datasets.advice_file import ADVICE
from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.evaluation.classes import ALL, class_order
from rgspipe.evaluation.plots import LABELS
from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.model.known_images import Strength
from rgspipe.fitting.result_text import ambient_line, base_line, ending, light_line
from rgspipe.fitting.words import MEANINGS
from rgspipe.scene import LightRig
from rgspipe.stages.scene.export import world_of
from rgspipe.stages.scene.light_origin import origin_of
from rgspipe.store.artifacts import Artifact

#: Exposures that differ by less from 1 are those that were known.
KNOWN_EXPOSURE = 1e-9

#: Each of at most so many targets is shown; of more, a row a class.
FEW = 4

Row = Mapping[str, object]


def outcome(artifact: Artifact) -> list[str]:
    """Lines that say what lights fit_light or track found, or how far evaluate finds them from the truth."""
    return _TELLERS[artifact.stage](artifact)


def _fits(artifact: Artifact) -> list[str]:
    results = pd.read_csv(artifact.file("results.csv"), dtype={"target": str})
    if len(results) > FEW:
        return [*columns(_fit_rows(results)), f"Lights: {artifact.path}/<target>/lights.json"]
    lines = [line for row in results.to_dict("records") for line in _fit(artifact, row)]
    where = results["target"].iloc[0] if len(results) == 1 else "<target>"
    return [*lines, f"Lights: {artifact.path}/{where}/lights.json, pictures: fit.png beside them"]


def _fit(artifact: Artifact, row: Row) -> list[str]:
    path = artifact.file(f"{row['target']}/lights.json")
    lights, spreads, told = read_lights(path), read_covariances(path), read_json(path, "a fit's light file")
    end = ending(FitStatus(told["result"]), seconds(told["seconds"]))
    head = f"{row['target']} ({_class(row['occlusion'])}): {end}"
    if told["psnr"] is not None:
        head += f", PSNR {told['psnr']:.1f} dB"
    spread = dict(enumerate(spreads))
    lines = [f"  {light_line(light, spread.get(index))}" for index, light in enumerate(lights)]
    lines += _in_file(path, lights)
    lines += [f"  {line}" for line in _known_light(told)]
    lines += [] if told["reason"] == MEANINGS[FitStatus.CONVERGED] else [f"  {told['reason']}"]
    return [head, *lines, *_exposures(told["exposures"]), *_advice(artifact, str(row["target"]))]


def _in_file(path: Path, lights: LightRig) -> list[str]:
    """Where lights are in the file that the scene was made from, if the scene was moved or scaled."""
    world = world_of(1.0, origin_of(path))
    places = [world.place(light.position).tolist() for light in lights if not light.distant]
    if not places or (world.rescale == 1.0 and not any(world.offset)):
        return []
    told = ", ".join(f"({', '.join(f'{x:.4g}' for x in place)})" for place in places)
    return [f"  in the scene's own file (1 here is {world.unit:.4g} there): {told}; stage=export brings lamps there"]


def _known_light(told: Mapping[str, Any]) -> list[str]:
    """Light that is there beside the lamps, where the fit was to say how strong it is."""
    tellers = (("ambient", "radiance", ambient_line), ("base_scale", "factor", base_line))
    return [teller(_strength(told[name], value)) for name, value, teller in tellers if name in told]


def _strength(told: Mapping[str, Any], value: str) -> Strength:
    spread = [[float(number) for number in row] for row in told["covariance"]]  # JSON has infinity as a text
    numbers = (torch.tensor(rows, dtype=torch.float64) for rows in (told[value], spread))
    return Strength(*numbers, told["share"])


def _exposures(exposures: Sequence[float]) -> list[str]:
    """Exposures over that of the first view, where they were found out; those that are known are all 1."""
    if all(abs(exposure - 1.0) < KNOWN_EXPOSURE for exposure in exposures):
        return []
    return [f"  exposures of the views over the first one's: {', '.join(f'{value:.3f}' for value in exposures)}"]


def _advice(artifact: Artifact, target: str) -> list[str]:
    """What further views would help, where the fit was asked."""
    name = f"{target}/{ADVICE}"
    if name not in artifact.manifest["files"]:
        return []
    return [f"  further views: {read_json(artifact.file(name), 'advice on further views')['words']}"]


def _fit_rows(results: pd.DataFrame) -> list[list[str]]:
    rows = [["", "targets", "converged", "PSNR", "time"]]
    for name, group in _by_class(results):
        converged = f"{int((group['result'] == FitStatus.CONVERGED).sum())}"
        rows.append([name, f"{len(group)}", converged, decibels(group["psnr"].median()), time(group["seconds"])])
    return rows


def _by_class(results: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    classes = class_order(results["occlusion"])
    parts = [(_class(name), results[results["occlusion"] == name]) for name in classes]
    return parts if len(parts) == 1 else [*parts, ("all", results)]


def _evaluation(artifact: Artifact) -> list[str]:
    targets = pd.read_csv(artifact.file("metrics.csv"), dtype={"target": str})
    if len(targets) <= FEW:
        rows = [_target_row(row) for row in targets.to_dict("records")]
        named = ["", "", "position error", "stated", "intensity", "axis", "lights", "types", "PSNR", "time", ""]
        return [*columns(without_empty([named, *rows])), f"Errors: {artifact.path / 'metrics.csv'}"]
    summary = pd.read_csv(artifact.file("summary.csv"))
    single = len(summary["occlusion"].drop_duplicates()) <= 2  # One class, and all of them, which is the same.
    shown = summary[summary["occlusion"] != ALL] if single else summary
    named = ["", "targets", "position error", "worst", "solved", "intensity", "axis", "right number", "right types"]
    named += ["truth in 95 %", "time"]
    sought = read_json(artifact.file("metrics.json"), "what an evaluation found")["sought"]
    rows = [_summary_row(row, sought) for row in shown.to_dict("records")]
    return [*columns(without_empty([named, *rows])), f"Errors: {artifact.path / 'summary.csv'}, metrics.csv"]


def _target_row(row: Row) -> list[str]:
    measured = [row["position_error"], row["position_sd"], row["intensity_error"]]
    return [
        f"{row['target']}",
        # Targets of ours say it by their names, and the line fits a terminal without.
        "" if f"{row['target']}".startswith(f"{row['occlusion']}_") else _class(row["occlusion"]),
        *map(percent, measured),
        degrees(row["axis_error"]),
        _wrong_number(row),
        "wrong" if row["count_right"] is True and row["types_right"] is False else "",
        decibels(row["psnr"]),
        seconds(row["seconds"]),
        words(row["result"]),
    ]


def _wrong_number(row: Row) -> str:
    """ "2 found, 3 there"; nothing where the number of lights is right or not known."""
    return f"{row['lights_found']} found, {row['lights_true']:.0f} there" if row["count_right"] is False else ""


def _summary_row(row: Row, sought: Mapping[str, bool]) -> list[str]:
    """A row a class; of how often number and types are right only where these were sought."""
    return [
        _class(row["occlusion"]),
        f"{row['count']}",
        percent(row["median_position_error"]),
        percent(row["worst_position_error"]),
        percent(row["success_rate"], 0),
        percent(row["median_intensity_error"]),
        degrees(row["median_axis_error"]),
        percent(row["count_rate"], 0) if sought["number"] else "",
        percent(row["types_rate"], 0) if sought["types"] else "",
        percent(row["inside_95"], 0),
        seconds(row["median_seconds"]),
    ]


def _track(artifact: Artifact) -> list[str]:
    table = pd.read_csv(artifact.file("track.csv"), dtype={"target": str})
    frames = table.drop_duplicates("frame")
    counts = ", ".join(f"{count} {name}" for name, count in frames["status"].value_counts(sort=False).items())
    lines = [f"{len(frames)} frames: {counts}; {time(frames['seconds'])} a frame"]
    if "position_error" in table:
        # Errors of frames that say that they are uncertain are no measure of the others.
        known = table[~table["status"].isin(["uncertain", "lost"])].dropna(subset=["light"])
        rows = [["", "known in", "position error", "worst", "intensity", "axis"]]
        for light, own in known.groupby("light"):
            axis = own["axis_error"].median() if "axis_error" in own else math.nan
            found = [f"light {int(light) + 1}", f"{len(own)}", percent(own["position_error"].median())]
            rest = [percent(own["position_error"].max()), percent(own["intensity_error"].median()), degrees(axis)]
            rows.append(found + rest)
        lines += columns(without_empty(rows))
    return [*lines, f"Track: {artifact.path / 'track.png'}, track.csv, frames/"]


_TELLERS: Mapping[str, Callable[[Artifact], list[str]]] = {
    "fit_light": _fits,
    "evaluate": _evaluation,
    "track": _track,
}


def _class(name: object) -> str:
    return LABELS.get(str(name), str(name).replace("_", " "))
