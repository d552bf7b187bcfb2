"""Studies of recovered lights: over numbers of views, errors of images and model, classes and kinds of lights."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.advice_file import SUGGESTED, own_views_in_order
from rgspipe.stages.base import Need, StageContext
from rgspipe.stages.studies.cases import checked_cases, chosen_scenes
from rgspipe.stages.studies.compared_fits import fit_changes
from rgspipe.stages.studies.kind import StudyKind
from rgspipe.store.artifacts import Artifact
from rgspipe.studies.light_figure import light_figure
from rgspipe.studies.light_table import markdown
from rgspipe.studies.lights import case_rows, predicted_errors
from rgspipe.studies.written import Study

#: What an evaluation says of each target: columns that are not numbers.
TYPES = {"target": str, "result": str, "reason": str, "success": "boolean", "inside_95": "boolean"}
TYPES |= {"noise_allows": "boolean"}


@dataclass(frozen=True)
class LightStudyCell:
    """The fits of one case with one method and number of views.

    Attributes:
        scene, case: their names.
        changes: of the configuration.
        foretells: whether the fits say what more views would leave uncertain.
    """

    scene: str
    case: str
    changes: dict[str, object]
    foretells: bool


def _gather(context: StageContext) -> Study:
    config, cells = context.config, _cells(context.config)
    fits = iter(context.input_lists.get("fit_light", ()))
    parts, predictions = [], []
    for cell, evaluated in zip(cells, context.input_lists["evaluate"], strict=True):
        targets = pd.read_csv(evaluated.file("metrics.csv"), dtype=TYPES)
        rows = case_rows(cell.scene, cell.case, targets, config.seed)
        parts.append(rows)
        if cell.foretells:
            found = predicted_errors(targets, _advice(next(fits), targets))
            named = {name: rows[name].iloc[0] for name in ("scene", "case", "method")}
            predictions.append(found.assign(**named))
    table = pd.concat(parts, ignore_index=True)
    if predictions:
        table = table.merge(pd.concat(predictions), how="left")
    return Study(table, markdown(table, config.study.kind), light_figure(table, config.study.kind))


def _advice(fit: Artifact, targets: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """By target what its own further cameras would leave uncertain; a fit without lights says nothing."""
    files = {name: f"{name}/{SUGGESTED}" for name in targets["target"]}
    return {name: own_views_in_order(fit.file(file)) for name, file in files.items() if file in fit.manifest["files"]}


def _cells(config: RgspipeConfig) -> list[LightStudyCell]:
    return list(_each_cell(config))


def _each_cell(config: RgspipeConfig) -> Iterator[LightStudyCell]:
    wanted = config.study
    for scene, chosen in chosen_scenes(config):
        for case in checked_cases(chosen):
            for method, views in wanted.fits():
                foretells = wanted.kind == "views" and method == "search_lm" and views == min(wanted.views)
                changes = scene | fit_changes(chosen, chosen.study, method, views) | case.changes
                yield LightStudyCell(
                    chosen.scene.folder,
                    case.name,
                    changes | ({"fit.suggest_view": True} if foretells else {}),
                    foretells,
                )


def _keys(config: RgspipeConfig) -> tuple[str, ...]:
    """Intervals are drawn with the seed."""
    return ("study", "seed")


def _inputs(config: RgspipeConfig) -> list[Need]:
    needs = []
    for cell in _each_cell(config):
        needs += [Need("fit_light", cell.changes)] if cell.foretells else []
        needs.append(Need("evaluate", cell.changes))
    return needs


KIND = StudyKind(inputs=_inputs, gather=_gather, keys=_keys)
