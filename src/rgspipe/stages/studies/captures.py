"""Studies of captures: what bad ones cost, over cases and scenes."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.evaluation.markdown import markdown_table
from rgspipe.stages.base import Need, StageContext
from rgspipe.stages.sources import has_truth
from rgspipe.stages.studies.cases import checked_cases, chosen_scenes, target_limit
from rgspipe.stages.studies.kind import StudyKind
from rgspipe.store.artifacts import Artifact
from rgspipe.studies.capture_figure import capture_figure
from rgspipe.studies.captures import TRUTH, study_row, with_factors
from rgspipe.studies.written import Study

#: What tables leave out of the names of cases: captures are what is studied.
SECTION = "capture."

#: What study.md shows of study.csv: headings and formats.
SHOWN = {
    "scene": ("scene", ""),
    "case": ("capture", ""),
    "psnr": ("PSNR (dB)", ".1f"),
    "psnr_off_edges": ("off edges", ".1f"),
    "ssim": ("SSIM", ".4f"),
    "flip": ("FLIP", ".3f"),
    "albedo_l1": ("albedo error", ".2%"),
    "position_error": ("light: position error", ".2%"),
    "intensity_error": ("intensity error", ".2%"),
    "solved": ("solved", ".0%"),
    "factor": ("over true surfels", ".1f"),
}


def _gather(context: StageContext) -> Study:
    rows = []
    judged, evaluated = context.input_lists["judge"], context.input_lists["evaluate"]
    for (scene, case, _), quality, lights in zip(_cases(context.config), judged, evaluated, strict=True):
        rows.append(study_row(scene, case, _quality(quality), pd.read_csv(lights.file("summary.csv"))))
    table = with_factors(pd.DataFrame(rows))
    return Study(table, markdown_table(table, SHOWN), capture_figure(table))


def _quality(judged: Artifact) -> pd.DataFrame:
    """The quality table of a judgement.

    Raises:
        InputError: it is empty, as the dataset has no views that are left out of training.
    """
    table = pd.read_csv(judged.file("quality.csv"))
    if table.empty:
        raise InputError(
            judged.path,
            expected="a scene that was judged by views left out of training, to compare captures by",
            found="none: its dataset has no transforms_test.json",
            remedy="Move some frames of transforms_train.json there.",
        )
    return table


def _cases(config: RgspipeConfig) -> Iterator[tuple[str, str, dict[str, object]]]:
    """(scene, case, configuration changes) of every row; the last of a scene has true surfels where they are known."""
    for scene, chosen in chosen_scenes(config):
        for case in checked_cases(chosen):
            yield chosen.scene.folder, case.name.replace(SECTION, ""), scene | case.changes
        if has_truth(chosen):
            yield chosen.scene.folder, TRUTH, scene | {"freeze.surfels": "truth"}


def _inputs(config: RgspipeConfig) -> list[Need]:
    lights = {"fit.method": "search_lm", "fit.limit": target_limit(config), "fit.target": None}
    lights |= {"views.count": 1, "views.indices": None}
    needs = []
    for _, _, changes in _cases(config):
        needs += [Need("judge", changes), Need("evaluate", changes | lights)]
    return needs


KIND = StudyKind(inputs=_inputs, gather=_gather)
