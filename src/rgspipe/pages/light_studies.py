"""What a page shows of the studies of recovered lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from rgspipe.pages.html import figure_address
from rgspipe.studies.light_figure import light_figure
from rgspipe.studies.light_table import NOTES, shown_rows

#: What each kind is called, and asks.
TITLES = {
    "views": ("How many views it takes", "The same targets, fitted from their first views alone and from more."),
    "robustness": (
        "What errors of images and model cost",
        "The same targets, taken by worse cameras, or fitted with a scene or a number of lights that is wrong by a "
        "stated amount; the line through each panel is the first case.",
    ),
    "kinds": (
        "Kinds of lights",
        "Points and spots, alone and several, of known and unknown number and cone, drawn at random and rendered by "
        "Cycles; fits in the trained scene, and in the true one where a row says so.",
    ),
    "regions": (
        "How often 95 % regions hold the truth",
        "More targets of kinds of lights where 40 do not tell 97 from 100 %.",
    ),
    "adam": (
        "The paper’s method from random starts",
        "Kinds of lights that both methods look for on the same targets.",
    ),
    "classes": (
        "Where the light is",
        "Lights that the first camera sees, that are outside its picture, hidden from it, or around the corner.",
    ),
}
#: What a figure shows, for those who cannot see it.
ALT = {
    "views": "error, success and time against the number of views",
    "robustness": "errors of each case",
    "kinds": "errors of each kind of light",
    "regions": "errors of each kind of light",
    "adam": "errors of each kind of light and method",
    "classes": "errors of each class",
}


@dataclass(frozen=True)
class LightStudy:
    """A study of recovered lights.

    Attributes:
        kind: one of `lights.KINDS`.
        table: rows of `lights.case_rows`.
        remark: what the reader must know, or "".
    """

    kind: str
    table: pd.DataFrame
    remark: str = ""


def light_studies(studies: Sequence[LightStudy]) -> list[dict[str, Any]]:
    """Title, words, figure and table of each, as text and addresses."""
    return [_shown(study) for study in studies]


def _shown(study: LightStudy) -> dict[str, Any]:
    headings, rows = shown_rows(study.table, study.kind)
    title, words = TITLES[study.kind]
    methods = list(study.table["method"].unique())
    return {
        "title": f"{title}: {' beside '.join(methods)}" if len(methods) > 1 else title,
        "words": words,
        "remark": study.remark,
        "note": NOTES[study.kind],
        "alt": ALT[study.kind],
        "headings": headings,
        "rows": [list(row.values()) for row in rows],
        "figure": figure_address(lambda: light_figure(study.table, study.kind)),
    }
