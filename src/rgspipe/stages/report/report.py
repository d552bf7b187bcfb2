"""Put everything into one self-contained HTML file: tables, pictures, configuration and provenance."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.config.core import plain
from rgspipe.config.scene import MODELLED
from rgspipe.datasets.alternatives_file import ToldAlternative, read_alternatives
from rgspipe.datasets.grade_file import GRADE, load_grade
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.evaluation.light_plot import CameraMark
from rgspipe.pages import report
from rgspipe.pages.overview import scene_summary
from rgspipe.pages.provenance import StageRecord, stage_record
from rgspipe.scene import Surfels
from rgspipe.scene.grade import SceneGrade
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.report.captured import captured_lamps, captured_marks, captured_section
from rgspipe.stages.report.gallery import dataset_gallery
from rgspipe.stages.report.relit import found_relightings, relight_files
from rgspipe.stages.report.sections import found_galleries, found_sections, section_files
from rgspipe.stages.report.studies import found_captures, found_light_studies, study_files
from rgspipe.stages.sources import has_truth, trained_stage
from rgspipe.stages.studies.compared_fits import at_most, fit_changes, fits_of
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_bytes, write_json, write_text

REPORT = "report.html"
#: What a page over scenes shows of this one.
SUMMARY, VIEW, HELD_OUT = "summary.json", "view.png", "held_out.png"
#: Sections that say how a run is done, not what comes out of it.
_OPERATION = ("stage", "upstream", "outputs", "overview", "debug")


def run(context: StageContext) -> None:
    """Write report.html from the evaluations and what lies behind them, and what a page over scenes shows of it."""
    contents = _contents(context)
    write_json(context.folder / SUMMARY, scene_summary(contents))
    if contents.gallery is not None and contents.gallery.train:
        # The view with the most to see: what varies most compresses least.
        write_bytes(context.folder / VIEW, max((shot.png for shot in contents.gallery.train), key=len))
    held_out = _optional_bytes(next(iter(context.input_lists.get("judge", ())), None), "typical.png")
    if held_out is not None:
        write_bytes(context.folder / HELD_OUT, held_out)
    page = report.render_report(contents)
    write_text(context.folder / REPORT, page)
    context.note(bytes=len(page.encode("utf-8")), fits=len(contents.targets))


def _contents(context: StageContext) -> report.ReportContents:
    config = context.config
    # The evaluations with true surfels come last, as `_inputs` lists them.
    every, count = context.input_lists.get("evaluate", ()), len(fits_of(config, config.report))
    evaluations, with_truth = every[:count], every[count:]
    judged = context.input_lists.get("judge", ())
    described = [read_json(artifact.file("metrics.json"), "what an evaluation found") for artifact in evaluations]
    surfels = _surfels(context.inputs.get("freeze"))
    trained = context.inputs.get(trained_stage(config))
    verdicts = {"success": "boolean", "inside_95": "boolean", "count_right": "boolean", "types_right": "boolean"}
    targets = _table(evaluations, "metrics.csv", verdicts | {"result": str, "reason": str})
    study, remark = found_captures(config, judged)
    return report.ReportContents(
        scene=config.scene.folder,
        is_measured=config.scene.kind in MODELLED,
        summary=_table(evaluations, "summary.csv"),
        targets=targets,
        curves=_table(evaluations, "convergence.csv"),
        fits=_pictures(evaluations, described),
        surfels=surfels,
        cameras=_cameras(described),
        alternatives=_alternatives(context.input_lists.get("fit_light", ()), described),
        grade=_grade(context.inputs.get("freeze")),
        training=_training(trained),
        training_log=_optional_table(trained, "training.csv"),
        quality=_joined(judged, "quality.csv"),
        split=_joined(judged, "split.csv"),
        true_summary=_table(with_truth, "summary.csv") if with_truth else None,
        comparison=_optional_bytes(judged[0] if judged else trained, "comparison.png"),
        gallery=dataset_gallery(context.inputs.get("generate_dataset"), surfels, targets, captured_lamps(trained)),
        captured=captured_section(trained),
        captured_lamps=captured_marks(trained),
        study=study,
        study_remark=remark,
        light_studies=found_light_studies(config, context.inputs.get("freeze")),
        relightings=found_relightings(config, context.inputs.get("freeze")),
        galleries=found_galleries(config, surfels),
        sections=found_sections(config, context.inputs.get("freeze")),
        success_limit=config.evaluate.success,
        number_sought=any(content["sought"]["number"] for content in described),
        types_sought=any(content["sought"]["types"] for content in described),
        configuration=_configuration(config),
        stages=_stages(context, described),
        notes=_notes(described),
    )


def _table(artifacts: Iterable[Artifact], name: str, types: Mapping[str, Any] | None = None) -> pd.DataFrame:
    """The tables of this name of all artifacts, one below the other; empty tables add nothing."""
    parts = [pd.read_csv(artifact.file(name), dtype=types) for artifact in artifacts]
    filled = [part for part in parts if len(part)] or parts[:1]
    if not filled:
        return pd.DataFrame(columns=["method", "views", "occlusion", "target", "position_error"])
    return pd.concat(filled, ignore_index=True)


def _joined(artifacts: Sequence[Artifact], name: str) -> pd.DataFrame | None:
    """The filled tables of this name, one below the other; None without artifacts."""
    if not artifacts:
        return None
    parts = [pd.read_csv(artifact.file(name)) for artifact in artifacts]
    return pd.concat([part for part in parts if len(part)] or parts[:1], ignore_index=True)


def _pictures(artifacts: Iterable[Artifact], described: Iterable[Mapping[str, Any]]) -> list[report.FitPicture]:
    pictures = []
    for artifact, content in zip(artifacts, described, strict=True):
        for entry in content["pictures"]:
            caption = report.picture_caption(entry["target"], entry["kind"], entry["position_error"], entry["psnr"])
            pictures.append(report.FitPicture(_group(content), caption, artifact.file(entry["file"]).read_bytes()))
    return pictures


def _cameras(described: Iterable[Mapping[str, Any]]) -> list[CameraMark]:
    """The cameras of the evaluation with the most views."""
    most = max((content["cameras"] for content in described), key=len, default=[])
    return [CameraMark(tuple(item["origin"]), tuple(item["direction"]), item["angle"]) for item in most]


def _alternatives(
    fits: Iterable[Artifact], described: Iterable[Mapping[str, Any]]
) -> dict[tuple[str, int, str], Sequence[ToldAlternative]]:
    """What every fit weighed against its answer, by method, number of views and target."""
    found = {}
    for fit, content in zip(fits, described, strict=False):
        for row in content["summary"][:1]:
            for name in (name for name in fit.manifest["files"] if name.endswith("/lights.json")):
                found[row["method"], int(row["views"]), name.partition("/")[0]] = read_alternatives(fit.file(name))
    return found


def _surfels(freeze: Artifact | None) -> Surfels | None:
    return None if freeze is None else load_surfels(freeze.file("surfels.safetensors"))


def _grade(frozen: Artifact | None) -> SceneGrade | None:
    if frozen is None or GRADE not in frozen.manifest["files"]:
        return None
    return load_grade(frozen.file(GRADE))


def _training(trained: Artifact | None) -> Mapping[str, Any] | None:
    if trained is None or "metrics.json" not in trained.manifest["files"]:
        return None
    metrics = read_json(trained.file("metrics.json"), "the quality of the trained scene")
    return {"seconds": trained.manifest.get("seconds")} | metrics


def _optional_table(artifact: Artifact | None, name: str) -> pd.DataFrame | None:
    if artifact is None or name not in artifact.manifest["files"]:
        return None
    table = pd.read_csv(artifact.file(name))
    return table if len(table) else None


def _optional_bytes(artifact: Artifact | None, name: str) -> bytes | None:
    if artifact is None or name not in artifact.manifest["files"]:
        return None
    return artifact.file(name).read_bytes()


def _configuration(config: RgspipeConfig) -> str:
    shown = {key: value for key, value in plain(config).items() if key not in _OPERATION}
    return json.dumps(shown, indent=2)


def _stages(context: StageContext, described: Sequence[Mapping[str, Any]]) -> list[StageRecord]:
    """Every artifact behind the report, in the order of the pipeline; fits and evaluations stand in pairs."""
    records = [
        # What true surfels reach is judged last.
        stage_record(f"{stage} (true surfels)" if index else stage, artifact.manifest)
        for stage in ("generate_dataset", "init_depth", "train_surfels", "capture_surfels", "freeze", "judge")
        for index, artifact in enumerate(context.input_lists.get(stage, ()))
    ]
    for stage in ("fit_light", "evaluate"):
        for artifact, content in zip(context.input_lists.get(stage, ()), described, strict=False):
            records.append(stage_record(f"{stage} ({_group(content)})", artifact.manifest))
    return records


def _group(described: Mapping[str, Any]) -> str:
    """What an evaluation is about: its method and its number of views."""
    first = next(iter(described["summary"]), None)
    return "no targets" if first is None else report.group_title(first["method"], first["views"])


def _notes(described: Iterable[Mapping[str, Any]]) -> list[str]:
    """What the evaluations note, each once."""
    return list(dict.fromkeys(note for content in described for note in content["notes"]))


def _inputs(config: RgspipeConfig) -> list[Need | str]:
    """Evaluations of every method and view count, and everything before them for its provenance."""
    needs: list[Need | str] = []
    for method, views in fits_of(config, config.report):
        changes = fit_changes(config, config.report, method, views)
        needs += [Need("fit_light", changes), Need("evaluate", changes)]
    return [*needs, *_judgements(config), "freeze", trained_stage(config), "init_depth", "generate_dataset"]


def _judgements(config: RgspipeConfig) -> list[Need | str]:
    """Held-out views, and where it is known the same with surfels made from the truth, with their lights."""
    if config.scene.kind == "ply":
        return []
    if not (config.report.truth and has_truth(config)):
        return ["judge"]
    truth: dict[str, object] = {"freeze.surfels": "truth"}
    views = at_most(config, config.report.views[0])
    lights = truth | {"fit.method": "search_lm", "views.count": views, "views.indices": None}
    return ["judge", Need("judge", truth), Need("evaluate", lights)]


def _keys(config: RgspipeConfig) -> list[str]:
    """Everything that the report prints."""
    return [key for key in plain(config) if key not in _OPERATION]


STAGE = Stage(
    name="report",
    help="one HTML file with tables, pictures, configuration and provenance",
    inputs=_inputs,
    config_keys=_keys,
    files=lambda config: [
        *study_files(config),
        *relight_files(config),
        *section_files(config),
    ],
    run=run,
    own_keys=("scene.name", "scene.kind", "scene.path", "report", "evaluate.success"),
)
