"""One HTML file that holds everything: tables, pictures, configuration and provenance. Needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from rgspipe.evaluation import goals, metrics, plots
from rgspipe.evaluation.classes import ALL
from rgspipe.evaluation.grading import graded_words
from rgspipe.evaluation.light_plot import CameraMark, light_figure
from rgspipe.evaluation.quality_plots import split_figure
from rgspipe.pages.gallery import Gallery, Shot
from rgspipe.pages.glossary import GLOSSARY
from rgspipe.pages.highlights import highlights, tiles
from rgspipe.pages.html import MISSING, data_address, decimals, figure_address, picture_address, render
from rgspipe.pages.light_studies import LightStudy, light_studies
from rgspipe.pages.provenance import StageRecord
from rgspipe.pages.quality import compared_lights, quality_columns, quality_rows
from rgspipe.pages.relit import Relighting, relightings
from rgspipe.pages.room_view import Alternatives, LampMark, room_view
from rgspipe.pages.section import Section, shown_sections
from rgspipe.percent import percent
from rgspipe.scene import Surfels
from rgspipe.scene.grade import SceneGrade
from rgspipe.studies.capture_figure import capture_figure
from rgspipe.studies.captures import TRUTH

#: Pictures of fits and held-out views together, before they are encoded as text (which adds a third).
PICTURE_BYTES = 4_500_000
#: One picture of a training view or target: bytes, and pixels across.
SHOT_BYTES, SHOT_WIDTH = 80_000, 320
#: The drawing of cameras and lights.
PLAN_BYTES = 400_000


@dataclass(frozen=True)
class FitPicture:
    """A PNG of a fit with the words under it; `group` gathers pictures under one heading."""

    group: str
    caption: str
    png: bytes


@dataclass(frozen=True)
class ReportContents:
    """What the report shows. Empty tables and None mean "not there"; the report then says so in words.

    Attributes:
        scene: name of the scene.
        summary: rows of `summary_table`.
        targets: rows of `target_table`.
        curves: rows of `convergence_table`.
        fits: pictures of single fits.
        is_measured: whether it is a scene of the laboratory, of which something is wanted.
        surfels: of the frozen scene, or None.
        cameras: cameras of the targets.
        alternatives: what fits weighed against their answers.
        grade: of the frozen scene, where it was measured.
        training: the trainer's metrics: `test_psnr_mean`, `test_psnr_median`, `test_psnr_min`,
            `test_psnr_off_edges_mean`, `direct_only_psnr` [dB], `surfels`, `seconds`, `per_view`.
        training_log: one row a training round, or None.
        quality: rows of every measure of held-out views, with `surfels` and `light`, of the trained scene and where
            known of one made from the truth; None if nothing judged them.
        split: rows of the split of the squared error with `surfels` and `light`; empty if pixels cannot be told apart.
        true_summary: rows of `summary_table` for lights recovered with surfels made from the truth.
        comparison: PNG of truth, render and difference of held-out views, or None.
        gallery: pictures of the dataset, or None.
        captured: the lamps that were found in photographs under unknown lamps, where the scene is made of such.
        captured_lamps: these in the drawing of the room.
        study: rows of `study_row` of this scene: what bad captures cost; None if no study has been made.
        study_remark: what the reader must know of that study, or "".
        light_studies: studies of recovered lights that have been made, with the rows of this scene.
        relightings: the scene in other lights, as far as that was made.
        galleries: fit targets that were generated.
        sections: what else was made: courses of fits, a track.
        success_limit: position error up to which a target counts as solved.
        number_sought, types_sought: whether the number and the types of the lights were to be found out, not told.
        configuration: the full configuration as YAML or JSON text.
        stages: one record per artifact behind the report.
        notes: what the reader must know: what is missing and why.
    """

    scene: str
    summary: pd.DataFrame
    targets: pd.DataFrame
    curves: pd.DataFrame
    fits: Sequence[FitPicture] = ()
    is_measured: bool = False
    surfels: Surfels | None = None
    cameras: Sequence[CameraMark] = ()
    alternatives: Alternatives = field(default_factory=dict)
    grade: SceneGrade | None = None
    training: Mapping[str, Any] | None = None
    training_log: pd.DataFrame | None = None
    quality: pd.DataFrame | None = None
    split: pd.DataFrame | None = None
    true_summary: pd.DataFrame | None = None
    comparison: bytes | None = None
    gallery: Gallery | None = None
    captured: Sequence[Section] = ()
    captured_lamps: Sequence[LampMark] = ()
    study: pd.DataFrame | None = None
    study_remark: str = ""
    light_studies: Sequence[LightStudy] = ()
    relightings: Sequence[Relighting] = ()
    galleries: Sequence[Section] = ()
    sections: Sequence[Section] = ()
    success_limit: float = metrics.SUCCESS_LIMIT
    number_sought: bool = False
    types_sought: bool = False
    configuration: str = ""
    stages: Sequence[StageRecord] = ()
    notes: Sequence[str] = field(default_factory=tuple)


def render_report(contents: ReportContents) -> str:
    """The report as one HTML document without any reference to a file or an address."""
    method = goals.primary_method(contents.summary)
    budget = PICTURE_BYTES // max(1, len(contents.fits) + (contents.comparison is not None))
    found = highlights(contents.quality, contents.summary, contents.true_summary, contents.training)
    return render(
        "report.html",
        contents=contents,
        tiles=tiles(found),
        grade=None if contents.grade is None else graded_words(contents.grade),
        gallery=_gallery(contents.gallery),
        study=[] if contents.study is None else contents.study.to_dict("records"),
        light_studies=light_studies(contents.light_studies),
        relightings=relightings(contents.relightings),
        galleries=shown_sections(contents.galleries),
        found=shown_sections(contents.sections),
        captured=shown_sections(contents.captured),
        true_surfels=TRUTH,
        goals=_goals(contents, found["psnr"], method) if contents.is_measured else [],
        method=method,
        training=_training_rows(contents.training),
        comparison=picture_address(contents.comparison, budget),
        quality_columns=[] if contents.quality is None else quality_columns(contents.quality),
        quality=[] if contents.quality is None else quality_rows(contents.quality),
        compared=[] if contents.true_summary is None else compared_lights(contents.summary, contents.true_summary),
        summary=contents.summary.to_dict("records"),
        targets=_target_rows(contents.targets),
        fits=_grouped_fits(contents.fits, budget),
        figures=_figures(contents),
        room=_room(contents),
        glossary=GLOSSARY,
        worst_views=_worst_views(contents.training),
        all_classes=ALL,
        success_limit=contents.success_limit,
    )


def _room(contents: ReportContents) -> dict[str, Any] | None:
    if contents.surfels is None:
        return None
    return room_view(
        contents.surfels, contents.targets, contents.cameras, contents.alternatives, contents.captured_lamps
    )


def _goals(contents: ReportContents, psnr: float | None, method: str) -> list[goals.Goal]:
    training = dict(contents.training or {}) | {"test_psnr_mean": psnr}
    kinds = [study.table for study in contents.light_studies if study.kind == "kinds"]
    return goals.goals(contents.scene, contents.summary, training, method, kinds[0] if kinds else None)


def group_title(method: str, views: int) -> str:
    """The heading over what one method did with a number of views."""
    return f"{method}, {views} view{'s' if views != 1 else ''}"


def picture_caption(target: str, kind: str, position_error: float | None, psnr: float | None) -> str:
    """The words under a fit's picture; `kind` is "median", "worst" or "landscape"."""
    if kind == "landscape":
        return f"{target}: loss around the recovered light, intensity the best one at each place"
    measured = []
    if position_error is not None:
        measured.append(f"position error {percent(float(position_error))}")
    if psnr is not None:
        measured.append(f"PSNR {decimals(float(psnr), 1)} dB")
    return f"{target}, {kind} of its class" + (": " + ", ".join(measured) if measured else "")


def _gallery(gallery: Gallery | None) -> dict[str, Any] | None:
    """Pictures of the dataset as addresses."""
    if gallery is None:
        return None
    classes = [
        {"name": one.name, "words": one.words, "count": one.count, "shots": _shots(one.shots)}
        for one in gallery.classes
    ]
    plan = picture_address(gallery.plan, PLAN_BYTES)
    return {"counts": gallery.counts, "train": _shots(gallery.train), "classes": classes, "plan": plan}


def _shots(shots: Sequence[Shot]) -> list[dict[str, Any]]:
    return [
        {"caption": shot.caption, "alt": shot.alt, "source": picture_address(shot.png, SHOT_BYTES, SHOT_WIDTH)}
        for shot in shots
    ]


def _grouped_fits(pictures: Sequence[FitPicture], budget: int) -> list[dict]:
    groups: dict[str, list[dict]] = {}
    for picture in pictures:
        shown = {"caption": picture.caption, "source": picture_address(picture.png, budget)}
        groups.setdefault(picture.group, []).append(shown)
    return [{"name": name, "pictures": members} for name, members in groups.items()]


_TRAINING_ROWS = (
    ("test_psnr_mean", "PSNR of held-out views under held-out lights, mean", "dB", 2),
    ("test_psnr_median", "… median", "dB", 2),
    ("test_psnr_min", "… worst view", "dB", 2),
    ("test_psnr_off_edges_mean", "… mean away from silhouettes and creases", "dB", 2),
    ("direct_only_psnr", "the same scene without interreflection, mean", "dB", 2),
    ("surfels", "surfels", "", 0),
    ("seconds", "training time", "s", 1),
)


def _training_rows(training: Mapping[str, Any] | None) -> list[dict]:
    if training is None:
        return []
    rows = []
    for key, label, unit, digits in _TRAINING_ROWS:
        value = training.get(key)
        if value is not None:
            rows.append({"label": label, "value": f"{float(value):,.{digits}f} {unit}".strip()})
    return rows


def _worst_views(training: Mapping[str, Any] | None, count: int = 5) -> list[dict]:
    views = [view for view in (training or {}).get("per_view", ()) if view.get("psnr") is not None]
    return sorted(views, key=lambda view: view["psnr"])[:count]


def _target_rows(targets: pd.DataFrame) -> list[dict]:
    """Rows with a verdict in words and numbers to sort by (browsers must not parse "0.31 %")."""
    rows = []
    for row in targets.to_dict("records"):
        verdict = "unknown" if row["success"] is None or pd.isna(row["success"]) else ("no", "yes")[int(row["success"])]
        if verdict != "unknown" and not row["count_right"]:
            verdict = f"no: {row['lights_found']} found, {row['lights_true']:.0f} there"
        elif verdict != "unknown" and not row["types_right"]:
            verdict += ", wrong type"
        strength = " / ".join(decimals(row[colour], 3) for colour in "rgb")
        estimate, truth = (", ".join(decimals(row[axis + suffix], 3) for axis in "xyz") for suffix in ("", "_true"))
        ended, why = (
            row[name] if isinstance(row[name], str) and row[name] else MISSING for name in ("result", "reason")
        )
        told = {"verdict": verdict, "estimate": estimate, "strength": strength, "truth": truth}
        rows.append(row | told | {"ended": ended, "why": why})
    return rows


def _figures(contents: ReportContents) -> dict[str, Any]:
    """Every figure as an address, or the reason why it is not there; lights per method and view count."""
    return {
        "errors": figure_address(lambda: plots.error_figure(contents.targets)),
        "convergence": figure_address(lambda: plots.convergence_figure(contents.curves)),
        "training": figure_address(lambda: plots.training_figure(contents.training_log))
        if contents.training_log is not None
        else {"source": None, "reason": "no training log"},
        "split": figure_address(lambda: split_figure(contents.split))
        if contents.split is not None
        else {"source": None, "reason": "nothing judged the scene"},
        "study": None if contents.study is None else figure_address(lambda: capture_figure(contents.study)),
        "lights": _light_figures(contents),
    }


def _light_figures(contents: ReportContents) -> list[dict]:
    if contents.surfels is None:
        return []
    drawn = []
    for (method, views), group in contents.targets.groupby(["method", "views"], sort=False):
        figure = light_figure(group, contents.surfels.centers, contents.surfels.normals, contents.cameras)
        title = group_title(method, views)
        # A bitmap: thousands of dots would be far larger as drawing commands.
        drawn.append({"title": title, "source": data_address(plots.png_of(figure), "image/png")})
    return drawn
