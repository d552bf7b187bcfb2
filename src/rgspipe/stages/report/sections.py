"""What a report shows of stages that may have been run beside it: generated targets, courses of fits, a track."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import torch

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import open_dataset
from rgspipe.errors import InputError
from rgspipe.evaluation.classes import class_of
from rgspipe.evaluation.plots import png_of
from rgspipe.pages.gallery import Shot, light_words, picture, spread
from rgspipe.pages.html import bare_percent, decimals, label
from rgspipe.pages.section import Section
from rgspipe.pages.targets_figure import targets_figure
from rgspipe.percent import percent
from rgspipe.scene import LightRig, Surfels
from rgspipe.stages.report.studies import newest_studies, study_rows
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.store.manifest import MANIFEST

#: Generated targets that are shown of each kind.
SHOWN = 4

#: Most lights of a target that are named one by one.
NAMED = 2

#: What the lights of each kind of generated targets are, in the order in which they are shown.
KINDS = {
    "points": "Point lights",
    "spots": "Spots",
    "mixed": "Points and spots",
    "drive": "Headlights of a car that drives around the bend",
}


def section_files(config: RgspipeConfig) -> list[Path]:
    """The manifests of what `found_galleries` and `found_sections` take: they hold the checksums of all files."""
    found = [*_generated(config), *newest_studies(config, "courses"), *_newest(config, "track").values()]
    return [artifact.path / MANIFEST for artifact in found]


def found_galleries(config: RgspipeConfig, surfels: Surfels | None) -> list[Section]:
    """Of each kind and number of lights the newest generated targets, kind by kind, from few lights to many."""
    return [] if surfels is None else [_targets(made, surfels) for made in _generated(config)]


def found_sections(config: RgspipeConfig, freeze: Artifact | None) -> list[Section]:
    """The newest courses of fits, of each set of methods, and the newest track.

    Args:
        freeze: the frozen scene that the report shows.
    """
    courses = [
        _courses(made, study_rows(made, config), _remark(made, freeze)) for made in newest_studies(config, "courses")
    ]
    return courses + [_track(made, _remark(made, freeze)) for made in _newest(config, "track").values()]


def _targets(made: Artifact, surfels: Surfels) -> Section:
    folder = made.folder()
    targets = open_dataset(folder, train=False, test=False).targets
    rigs = {target.name: read_lights(folder / "truth" / f"{target.name}.json") for target in targets}
    chosen = [targets[index] for index in spread(len(targets), SHOWN)]
    numbered = {target.name: f"{number}" for number, target in enumerate(chosen, 1)}
    origins = torch.stack([view.camera.origin for view in targets[0].views])
    figure = targets_figure(
        {numbered[name]: rigs[name] for name in numbered},
        [rig for name, rig in rigs.items() if name not in numbered],
        surfels.centers,
        surfels.normals,
        origins,
    )
    shots = []
    for target in chosen:
        rig, number = rigs[target.name], numbered[target.name]
        name = label(class_of(target.occlusion, len(rig)))
        words = f"{number} · {target.name}, {name}: {_rig_words(rig)}"
        shots.append(Shot(words, f"target {target.name}, {name}", picture(target.views[0])))
    return Section(
        f"generated-{made.fingerprint}",
        _title(str(made.facts["kind"]), sorted({len(rig) for rig in rigs.values()})),
        [f"{len(targets)} targets, each seen by {len(targets[0].views)} cameras."],
        drawings=[Shot("", "lights of the targets, from above and from the side", png_of(figure, dpi=120))],
        shots=shots,
    )


def _title(kind: str, counts: list[int]) -> str:
    """Kind and numbers of the lights of generated targets: "Spots, 1 to 3 a target"."""
    many = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else f"{counts[0]}"
    return f"{KINDS.get(kind, kind)}, {many} a target"


def _rig_words(rig: LightRig) -> str:
    """The lights of a target; of many only how many."""
    if len(rig) <= NAMED:
        return light_words(rig)
    counted = Counter("point light" if light.axis is None else light.kind for light in rig)
    return " and ".join(f"{count} {name}{'s' if count > 1 else ''}" for name, count in sorted(counted.items()))


def _courses(made: Artifact, summary: pd.DataFrame, remark: str) -> Section:
    columns = ["<Target", "<Light", "<Method", "Steps", "Time (s)", "Solved after (s)"]
    columns += ["Position error (%)", "Intensity error (%)", "Image error (%)"]
    rows = [
        [row["target"], label(row["occlusion"]), row["method"], f"{row['steps']}", decimals(row["seconds"])]
        + [decimals(row["seconds_to_limit"])]
        + [" → ".join(bare_percent(row[f"{name}_{end}"]) for end in ("start", "end")) for name in _COMPARED]
        for row in summary.to_dict("records")
    ]
    methods = dict.fromkeys(summary["method"])
    pictures = {name: made.file(f"pictures/{name}.png").read_bytes() for name in dict.fromkeys(summary["target"])}
    return Section(
        f"courses-{made.fingerprint}",
        f"From start to answer: {' beside '.join(methods)}",
        ["What each method does with the same targets, from where it starts to what it answers."],
        columns,
        rows,
        "Steps and start are those of the start that won; seconds count from the beginning of the fit, so that they "
        "hold the search before it and other starts. Position errors are fractions of the scene; the image’s error "
        "is the sum of squared differences to the target over that of its squares, of all pixels.",
        drawings=[Shot(name, f"the course of fits of {name}", png) for name, png in pictures.items()],
        remark=remark,
    )


def _track(made: Artifact, remark: str) -> Section:
    table = pd.read_csv(made.file("track.csv"), dtype={"target": str})
    frames = table.drop_duplicates("frame")
    counts = ", ".join(f"{count} {name}" for name, count in frames["status"].value_counts(sort=False).items())
    known = table[~table["status"].isin(["uncertain", "lost"])].dropna(subset=["light"])
    rows = []
    for light, own in known.groupby("light") if "position_error" in table else ():
        axis = decimals(own["axis_error"].median()) if "axis_error" in own else "—"
        errors = [own["position_error"].median(), own["position_error"].max(), own["intensity_error"].median()]
        rows.append([f"light {int(light) + 1}", f"{len(own)}", *map(percent, errors), axis])
    drawn = Shot(
        "Pale: uncertain. Circled: found anew, or lost.", "the track of the lights", made.file("track.png").read_bytes()
    )
    return Section(
        "track",
        "Lights that move",
        [
            f"{len(frames)} frames: {counts}; {decimals(frames['seconds'].median())} s a frame "
            f"(worst {decimals(frames['seconds'].max())} s)."
        ],
        ["<Light", "Known in", "Median position error", "Worst", "Median intensity error", "Median axis error (°)"],
        rows,
        "Errors are those of the frames in which the lights are known: neither uncertain nor lost.",
        drawings=[drawn],
        remark=remark,
    )


_COMPARED = ("position_error", "intensity_error", "image_error")


def _remark(made: Artifact, freeze: Artifact | None) -> str:
    same = freeze is not None and freeze.fingerprint in made.manifest["inputs"].get("freeze", ())
    return "" if same else f"Made on {_made(made)[:10]}, of another frozen scene than the rest of this page shows."


def _generated(config: RgspipeConfig) -> list[Artifact]:
    newest = _newest(config, "generate_targets", lambda made: f"{made.facts['kind']} {_count(made)}")
    order = {kind: place for place, kind in enumerate(KINDS)}
    return sorted(newest.values(), key=lambda made: (order.get(str(made.facts["kind"]), len(order)), _count(made)))


def _count(made: Artifact) -> list[int]:
    """Fewest and most lights of generated targets."""
    return list(made.manifest["config"].get("targets.count") or ())


def _newest(
    config: RgspipeConfig, stage: str, group: Callable[[Artifact], str] = lambda made: ""
) -> dict[str, Artifact]:
    """The newest artifact of a stage, of each group."""
    store, newest = ArtifactStore(Path(config.outputs)), {}
    for path in sorted((Path(config.outputs) / config.scene.folder / stage).glob(f"[!.]*/{MANIFEST}")):
        if path.parent.is_symlink():
            continue
        try:
            found = store.find(Key(config.scene.folder, stage, path.parent.name))
        except InputError:
            continue
        if found is not None and (group(found) not in newest or _made(found) > _made(newest[group(found)])):
            newest[group(found)] = found
    return newest


def _made(artifact: Artifact) -> str:
    """When it was made, as text that sorts by time."""
    return str(artifact.manifest.get("created", ""))
