"""The study of the zoo: rooms that nobody tuned, each rendered, trained, frozen, and its lights looked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pandas as pd

from rgspipe.blender.options import ZooParameters
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.frames import read_entries
from rgspipe.datasets.grade_file import GRADE, load_grade
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.scene.models.zoo import ZooRoom, draw_room
from rgspipe.stages.base import Failure, Need, StageContext
from rgspipe.stages.studies.cases import checked_cases, target_limit
from rgspipe.stages.studies.kind import StudyKind
from rgspipe.stages.studies.lights import TYPES
from rgspipe.store.artifacts import Artifact
from rgspipe.studies.written import Study
from rgspipe.studies.zoo import MEASURED, Row, failed_rows, fit_rows, fits_table, summary
from rgspipe.studies.zoo_figure import zoo_figure
from rgspipe.studies.zoo_page import page
from rgspipe.studies.zoo_rooms import camera_properties, part_of, photographed, room_properties, share_unseen

#: The figures of all groups of fits, beside the table of all fits.
SUMMARY = "summary.csv"

#: Classes of targets that a room has.
CLASSES = ("visible", "out_of_frame", "occluded")

#: The stages that a cell needs one artifact of each of.
STAGES = ("generate_dataset", "train_surfels", "freeze", "evaluate")


@dataclass(frozen=True)
class ZooStudyCell:
    """The fits of one room in one case, with one method and number of views.

    Attributes:
        seed, case: their names.
        changes: of the configuration.
        config: with them.
    """

    seed: int
    case: str
    changes: dict[str, object]
    config: RgspipeConfig


def _gather(context: StageContext) -> Study:
    cells = list(_cells(context.config))
    attempts = zip(*(context.attempts(stage, len(cells)) for stage in STAGES), strict=True)
    table = fits_table([row for cell, made in zip(cells, attempts, strict=True) for row in _rows(cell, *made)])
    figures = summary(table, context.config.seed)
    context.note(failed=int((table["failed_in"].notna()).sum()))
    beside = {SUMMARY: figures.to_csv(index=False).encode()}
    return Study(table, page(table, figures), zoo_figure(table), beside)


def _rows(cell: ZooStudyCell, *made: Artifact | Failure) -> list[Row]:
    """The fits of a cell, or why there are none."""
    *scene, evaluated = made
    room = _properties(cell, *scene)
    if isinstance(evaluated, Artifact):
        return fit_rows(room, pd.read_csv(evaluated.file("metrics.csv"), dtype=TYPES))
    config = cell.config
    return failed_rows(
        room, CLASSES, config.fit.method, config.views.count, stage=evaluated.stage, reason=evaluated.reason
    )


def _properties(
    cell: ZooStudyCell, dataset: Artifact | Failure, trained: Artifact | Failure, frozen: Artifact | Failure
) -> dict[str, Any]:
    """What a room is like, how it was photographed and trained; None for what is not known."""
    config, room = cell.config, _room(cell.config.scene.zoo)
    known = {"seed": cell.seed, "part": part_of(cell.seed), "case": cell.case} | room_properties(room)
    known |= {"train_views": config.capture.views or config.dataset.train_views, "noise": config.capture.image_noise}
    known |= dict.fromkeys((*MEASURED, "stand", "grade"))
    if isinstance(dataset, Artifact):
        entries = read_entries(dataset_root(dataset.folder()) / "transforms_train.json", "the training views")
        size = config.dataset.resolution
        known |= camera_properties(room, [entry.camera(size, size) for entry in entries])
    if isinstance(trained, Artifact):
        known |= _training(trained)
    if isinstance(frozen, Artifact):
        grade = load_grade(frozen.file(GRADE))
        known |= {"grade": str(grade.grade), "grade_error": grade.error, "guessed": grade.guessed}
    return known


def _room(zoo: ZooParameters) -> ZooRoom:
    return draw_room(zoo.seed, zoo.plan, zoo.tone, zoo.fronts)


def _training(trained: Artifact) -> dict[str, Any]:
    metrics = read_json(trained.file("metrics.json"), "the measures of a training")
    surfels = load_surfels(trained.file("surfels.safetensors"))
    return {
        "unseen": share_unseen(surfels),
        "surfels": len(surfels),
        "held_out_psnr": metrics.get("test_psnr_mean"),
        "training_seconds": metrics["seconds"],
    }


def _cells(config: RgspipeConfig) -> Iterator[ZooStudyCell]:
    for seed in config.study.zoo.seeds:
        room = _room_changes(config, seed)
        for case in checked_cases(with_changes(config, room)):
            for method in config.study.methods:
                for views in config.study.views:
                    fits = {"fit.method": method, "views.count": views, "views.indices": None}
                    fits |= {"fit.limit": target_limit(config)}
                    changes = room | fits | case.changes
                    yield ZooStudyCell(seed, case.name, changes, with_changes(config, changes))


def _room_changes(config: RgspipeConfig, seed: int) -> dict[str, object]:
    """What makes the configuration that of a room: its seed, and how it is photographed."""
    wanted = config.study.zoo
    ranges = (wanted.fewest_views, wanted.most_views), (wanted.least_noise, wanted.most_noise)
    views, noise = photographed(seed, *ranges)
    changes: dict[str, object] = {"scene.kind": "zoo", "scene.name": f"zoo_{seed}", "scene.zoo.seed": seed}
    changes |= {"dataset.train_views": views, "capture.image_noise": noise, "target_capture.noise": noise}
    return changes | {"capture.seed": seed, "target_capture.seed": seed}


def _inputs(config: RgspipeConfig) -> list[Need]:
    return [Need(stage, cell.changes, may_fail=True) for cell in _cells(config) for stage in STAGES]


def _keys(config: RgspipeConfig) -> tuple[str, ...]:
    """Rooms are drawn as `scene.zoo` says, intervals with the seed."""
    return ("study", "seed", "scene.zoo", "dataset", "capture")


KIND = StudyKind(inputs=_inputs, gather=_gather, keys=_keys)
