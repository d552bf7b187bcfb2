"""What usually comes after each stage: another one, with what this run has made, or a file of its to look at.

It stands here and not in the stages' own modules because their code counts: other words would train scenes again.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.json_file import read_json
from rgspipe.stages.sources import has_truth, trained_stage
from rgspipe.store.artifacts import Artifact


@dataclass(frozen=True)
class Following:
    """What usually comes next.

    Attributes:
        purpose: what it is for, such as "to see its lamps in the browser".
        stage: that is run for it, as this run was but for `changes`; None where a file is opened.
        changes: values by dotted key.
        file: of this run's result; empty for the folder.
    """

    purpose: str
    stage: str | None = None
    changes: Mapping[str, object] | None = None
    file: str = ""


#: What a fit found out that doubts the number of lamps, and how one ended that further views could help.
NUMBER, OPEN = ("light_missing", "light_spare"), ("ambiguous", "undetermined")

#: What comes next, from the configuration of a run and the artifact that it has made.
Choice = Callable[[RgspipeConfig, Artifact], Following]

LOOK = Following("to move lamps through it in the browser", "view")
FOUND = Following("to see its lamps in the browser, and move them", "view")


def _learn(config: RgspipeConfig, made: Artifact) -> Following:
    lamps = "" if config.scene.lamps == "known" else ", and find the lamps that were on"
    return Following(f"to learn the surfaces from the photographs{lamps}", trained_stage(config))


def _find(config: RgspipeConfig, made: Artifact) -> Following:
    """The lamps of targets, where a scene has some; else there is the scene to look at."""
    changes = {"freeze.surfels": "truth"} if made.stage == "true_surfels" else {}
    if not _has(config, "targets"):
        return FOUND if made.stage == "capture_surfels" else LOOK
    return _compare(changes) if _has(config, "truth") else Following("to find the lamps of its targets", "fit_light")


def _compare(changes: Mapping[str, object]) -> Following:
    return Following("to find the lamps of its targets, and compare them with the truth", "evaluate", changes)


def _generated(config: RgspipeConfig, made: Artifact) -> Following:
    if config.targets.kind == "drive":
        return Following("to follow its lamps", "track")
    return _compare({"fit.targets": "generated"})


def _fitted(config: RgspipeConfig, made: Artifact) -> Following:
    if _has(config, "truth"):
        return Following("to compare them with the truth", "evaluate")
    told = list(_told(made))
    if config.light.count is not None and any(one["finding"] in NUMBER for fit in told for one in fit["findings"]):
        return Following("to have the lamps counted", "fit_light", {"light.count": None})
    if not config.fit.suggest_view and any(fit["result"] in OPEN for fit in told):
        return Following("to hear which further view would help most", "fit_light", {"fit.suggest_view": True})
    return FOUND


def _told(made: Artifact) -> Iterator[dict[str, Any]]:
    """What the fit of each target said."""
    with made.file("results.csv").open(encoding="utf-8", newline="") as table:
        names = [row["target"] for row in csv.DictReader(table)]
    return (read_json(made.file(f"{name}/lights.json"), "a fit's light file") for name in names)


def _has(config: RgspipeConfig, what: Literal["targets", "truth"]) -> bool:
    """Whether what would be fitted has targets, or their truth."""
    if config.fit.target is not None:
        return what == "targets" or config.fit.truth is not None
    if has_truth(config):
        return config.fit.targets == "generated" or config.dataset.targets_per_class > 0
    return config.scene.kind == "external" and (Path(config.scene.path or "") / what).is_dir()


def _exported(config: RgspipeConfig, made: Artifact) -> Following:
    if config.export.lights is None:
        return Following("open in a viewer of Gaussians", file="surfels.ply")
    return Following("read what each lamp is, and what which format does not hold", file="lamps.txt")


def _picture(*names: str) -> Choice:
    """The first of these files that there is, or the folder."""

    def choose(config: RgspipeConfig, made: Artifact) -> Following:
        return Following("look at", file=next((name for name in names if name in made.manifest["files"]), ""))

    return choose


def _always(following: Following) -> Choice:
    return lambda config, made: following


#: By stage.
FOLLOWING: Mapping[str, Choice] = {
    "import_scan": _learn,
    "generate_dataset": _learn,
    "init_depth": _learn,
    "train_surfels": _find,
    "capture_surfels": _find,
    "true_surfels": _find,
    "import_ply": _find,
    "freeze": _find,
    "judge": _find,
    "render_olat": _always(Following("to add them up to targets", "generate_targets")),
    "generate_targets": _generated,
    "fit_light": _fitted,
    "evaluate": _always(FOUND),
    "track": _picture("track.png"),
    "relight": _picture("comparison.png", "sheet.png", "strip.png"),
    "export": _exported,
    "study": _picture("study.png"),
    "report": _always(Following("open in a browser", file="report.html")),
    "overview": _always(Following("open in a browser", file="overview.html")),
    "render_truth": _always(Following("to measure the renderer against them", "benchmark")),
    "benchmark": _picture("accuracy.md", "search.md", "benchmark.csv"),
}


def following(config: RgspipeConfig, made: Artifact) -> Following | None:
    """What usually comes after a run; None after a stage that nobody here knows."""
    choose = FOLLOWING.get(made.stage)
    return None if choose is None else choose(config, made)
