"""Compare what bad captures cost, over cases and scenes: one table, one figure."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from rgspipe.benchmark.markdown import markdown_table
from rgspipe.config import RgspipeConfig, scene_name, with_changes
from rgspipe.errors import InputError
from rgspipe.evaluation.plots import png_of
from rgspipe.evaluation.quality_plots import study_figure
from rgspipe.evaluation.study import CLEAN, SECTION, TRUTH, parse_case, study_row, with_factors
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.sources import has_truth

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


def run(context: StageContext) -> None:
    """Write study.csv, study.md and study.png."""
    rows = []
    judged, evaluated = context.input_lists["judge"], context.input_lists["evaluate"]
    for (scene, case, _), quality, lights in zip(_cases(context.config), judged, evaluated, strict=True):
        tables = pd.read_csv(quality.file("quality.csv")), pd.read_csv(lights.file("summary.csv"))
        rows.append(study_row(scene, case, *tables))
    table = with_factors(pd.DataFrame(rows))
    table.to_csv(context.folder / "study.csv", index=False)
    (context.folder / "study.md").write_text(markdown_table(table, SHOWN), encoding="utf-8")
    (context.folder / "study.png").write_bytes(png_of(study_figure(table)))
    context.note(cases=len(table))


def _cases(config: RgspipeConfig) -> Iterator[tuple[str, str, dict[str, object]]]:
    """(scene, case, configuration changes) of every row; the last of a scene has true surfels where they are known."""
    kinds = config.study.scenes or [None]
    for kind in kinds:
        scene: dict[str, object] = {} if kind is None else {"scene.kind": kind, "scene.name": None}
        chosen = with_changes(config, scene)
        for text in config.study.cases:
            yield scene_name(chosen), text.strip(), scene | _checked(chosen, text)
        if has_truth(chosen):
            yield scene_name(chosen), TRUTH, scene | {"freeze.surfels": "truth"}


def _checked(config: RgspipeConfig, text: str) -> dict[str, object]:
    changes = parse_case(text)
    try:
        with_changes(config, changes)
    except ValueError as error:
        raise InputError(
            "study.cases",
            expected=f"keys of {SECTION}.*",
            found=f"{text!r}: {error}",
            remedy=f"python -m rgspipe --help {SECTION} lists them; a case without errors is {CLEAN}.",
        ) from None
    return changes


def _inputs(config: RgspipeConfig) -> list[Need]:
    lights = {"fit.method": "search_lm", "fit.limit": config.study.limit, "fit.target": None}
    lights |= {"views.count": 1, "views.indices": None}
    needs = []
    for _, _, changes in _cases(config):
        needs += [Need("judge", changes), Need("evaluate", changes | lights)]
    return needs


STAGE = Stage(
    name="study",
    help="what bad captures cost: images, albedo and recovered lights, over cases and scenes",
    run=run,
    inputs=_inputs,
    config_keys=("study",),
    code=("rgspipe.benchmark.markdown", "rgspipe.evaluation"),
)
