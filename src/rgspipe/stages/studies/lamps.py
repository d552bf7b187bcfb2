"""The study of captures under unknown lamps: how well these are found, and lamps that are switched on later."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.json_file import read_json
from rgspipe.evaluation.markdown import markdown_table
from rgspipe.stages.base import Failure, Need, StageContext
from rgspipe.stages.studies.cases import checked_cases, chosen_scenes
from rgspipe.stages.studies.kind import StudyKind
from rgspipe.store.artifacts import Artifact
from rgspipe.studies.lamps import LATER, failed_row, lamp_rows, later_rows, summary
from rgspipe.studies.lamps_figure import lamps_figure
from rgspipe.studies.written import Study

#: What study.md shows of the summary: headings and formats.
SHOWN = {
    "scene": ("scene", ""),
    "case": ("capture", ""),
    "where": ("lamps", ""),
    "count": ("number", "d"),
    "failed": ("refused", "d"),
    "position_error": ("off (of the room)", ".2%"),
    "worst": ("worst", ".2%"),
    "intensity_error": ("intensity off", ".1%"),
    "inside_95": ("in the region of 95 %", ".0%"),
    "right": ("number right", ".0%"),
    "albedo": ("albedo off", ".1%"),
    "psnr": ("PSNR (dB)", ".1f"),
}

#: The figures of all groups of lamps, beside the table of all lamps.
SUMMARY = "summary.csv"


def _gather(context: StageContext) -> Study:
    cells = list(_cells(context.config))
    captured = context.attempts("capture_surfels", len(cells))
    later: Sequence[Artifact | Failure | None] = [None] * len(cells)
    if context.config.study.limit is not None:
        later = context.attempts("evaluate", len(cells))
    rows = [
        row
        for (scene, case, lighting, _), made, fits in zip(cells, captured, later, strict=True)
        for row in _rows({"scene": scene, "case": case, "lighting": lighting}, made, fits)
    ]
    table = pd.DataFrame(rows)
    figures = summary(table)
    context.note(failed=int(table["failed"].notna().sum()))
    return Study(
        table, markdown_table(figures, SHOWN), lamps_figure(table), {SUMMARY: figures.to_csv(index=False).encode()}
    )


def _rows(
    known: dict[str, Any], captured: Artifact | Failure, later: Artifact | Failure | None
) -> Iterator[dict[str, Any]]:
    """A row a lamp that was on, and one a lamp that was switched on later."""
    if isinstance(captured, Failure):
        yield failed_row(known, captured.reason)
        return
    yield from lamp_rows(known, read_json(captured.file("metrics.json"), "the measures of a capture"))
    if isinstance(later, Failure):
        yield failed_row(known, later.reason, LATER)
    elif later is not None:
        yield from later_rows(known, pd.read_csv(later.file("metrics.csv")))


def _cells(config: RgspipeConfig) -> Iterator[tuple[str, str, int, dict[str, object]]]:
    """(scene, case, lighting, configuration changes) of every capture."""
    for scene, chosen in chosen_scenes(config):
        for case in checked_cases(chosen):
            for lighting in range(config.dataset.seed, config.dataset.seed + config.study.lightings):
                own = {"scene.lamps": "unknown", "dataset.seed": lighting}
                yield chosen.scene.folder, case.name, lighting, scene | own | case.changes


def _inputs(config: RgspipeConfig) -> list[Need]:
    cells = [changes for _, _, _, changes in _cells(config)]
    needs = [Need("capture_surfels", changes, may_fail=True) for changes in cells]
    if config.study.limit is not None:
        fits = {"fit.method": "search_lm", "fit.limit": config.study.limit, "fit.target": None, "fit.poor_scene": True}
        needs += [Need("evaluate", fits | changes, may_fail=True) for changes in cells]
    return needs


KIND = StudyKind(inputs=_inputs, gather=_gather)
