"""One page over scenes: the best figures of each, a few pictures, and links to their own pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from rgspipe.evaluation import goals
from rgspipe.evaluation.classes import ALL
from rgspipe.pages.highlights import NAMES, highlights
from rgspipe.pages.html import picture_address, render
from rgspipe.pages.quality import compared_lights
from rgspipe.pages.report import ReportContents
from rgspipe.store.strict_json import as_json

#: Most bytes and pixels across of a scene's pictures.
VIEW_BYTES, VIEW_WIDTH = 120_000, 320
STRIP_BYTES, STRIP_WIDTH = 400_000, 1200


@dataclass(frozen=True)
class SceneEntry:
    """One scene of the page.

    Attributes:
        name: of the scene.
        address: of its own page, relative to this one.
        made: when that page was made, as text.
        summary: what `scene_summary` gave.
        view: PNG of a training view, or None.
        held_out: PNG of truth, render and difference of one held-out view, or None.
    """

    name: str
    address: str
    made: str
    summary: Mapping[str, Any]
    view: bytes | None = None
    held_out: bytes | None = None


def scene_summary(contents: ReportContents) -> dict[str, Any]:
    """What a page over scenes says of one, as strict JSON: `counts` of the dataset, `highlights` and `lights` by class.

    `lights`: of the main method with the fewest views, rows of `occlusion`, `count`, `position_error`,
    `true_position_error` (with surfels made from the truth) and `solved`; None for what is not known.
    """
    summary = {
        "counts": "" if contents.gallery is None else contents.gallery.counts,
        "highlights": highlights(contents.quality, contents.summary, contents.true_summary, contents.training),
        "lights": _lights(contents.summary, contents.true_summary),
    }
    return as_json(summary)


def render_overview(scenes: Sequence[SceneEntry], missing: Mapping[str, str]) -> str:
    """The page as one HTML document; only its links lead elsewhere.

    Args:
        scenes: those that have a page of their own, in the order in which they are shown.
        missing: those that have none, and the command that makes it.
    """
    shown = [
        {
            "name": scene.name,
            "address": scene.address,
            "made": scene.made,
            "counts": scene.summary["counts"],
            "highlights": dict.fromkeys(NAMES) | dict(scene.summary["highlights"]),
            "lights": scene.summary["lights"],
            "view": picture_address(scene.view, VIEW_BYTES, VIEW_WIDTH),
            "held_out": picture_address(scene.held_out, STRIP_BYTES, STRIP_WIDTH),
        }
        for scene in scenes
    ]
    absent = [{"name": name, "command": command} for name, command in missing.items()]
    return render("overview.html", scenes=shown, missing=absent)


def _lights(summary: pd.DataFrame, true_summary: pd.DataFrame | None) -> list[dict[str, Any]]:
    rows = summary[(summary["method"] == goals.primary_method(summary)) & (summary["occlusion"] != ALL)]
    if rows.empty:
        return []
    rows = rows[rows["views"] == rows["views"].min()]
    compared = [] if true_summary is None else compared_lights(rows, true_summary)
    true = {row["occlusion"]: row["truth"] for row in compared}
    return [
        {
            "occlusion": row["occlusion"],
            "count": int(row["count"]),
            "position_error": row["median_position_error"],
            "true_position_error": true.get(row["occlusion"]),
            "solved": row["success_rate"],
        }
        for row in rows.to_dict("records")
    ]
