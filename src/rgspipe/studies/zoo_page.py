"""The study of the zoo as people read it: figures of each part, then every room, then what went wrong."""

from __future__ import annotations

import pandas as pd

from rgspipe.evaluation.markdown import markdown_lines, markdown_table
from rgspipe.evaluation.plots import LABELS
from rgspipe.percent import percent
from rgspipe.studies.light_table import Row, with_interval
from rgspipe.studies.lights import several
from rgspipe.studies.written import FIGURE
from rgspipe.studies.zoo import EVERYTHING, FAILED, MISLED, misled
from rgspipe.studies.zoo_rooms import FINAL, WORK

NOTE = (
    "Medians with 95 % bootstrap intervals, shares with Wilson’s, both as if fits of one room were independent; "
    "position errors are parts of the room’s longest side. Stated: the median of the root mean square position errors "
    "that fits expect of themselves. Noise allows: lights whose least error, as far as the noise of their images goes, "
    "is within the limit, and at best: the median of that error (Cramér and Rao); both with the scene that was trained "
    "in place of the true one. Silent: the fit says converged, is off by more than the limit, and no region that it "
    "states holds the truth. A room that could not be trained or fitted counts as not "
    "solved, with infinite errors."
)

TITLES = {
    WORK: "Odd seeds: rooms that may be looked at while the program is worked on",
    FINAL: "Even seeds: rooms for final figures only",
}

#: What the list of rooms shows: headings and formats.
ROOMS = {
    "seed": ("seed", ""),
    "case": ("case", ""),
    "plan": ("plan", ""),
    "tone": ("tone", ""),
    "albedo": ("albedo", ".2f"),
    "fronts": ("fronts", ""),
    "pieces": ("furniture", ""),
    "stand": ("cameras", ""),
    "train_views": ("views", ""),
    "lens": ("lens (°)", ".0f"),
    "noise": ("noise", ".1%"),
    "unseen": ("unseen", ".1%"),
    "guessed": ("guessed", ".1%"),
    "held_out_psnr": ("PSNR (dB)", ".1f"),
    "training_seconds": ("training (s)", ".0f"),
    "grade": ("grade", ""),
    "grade_error": ("expected error", ".1%"),
}

#: What the lists of silent errors and of misleading grades show.
WRONG = {
    "seed": ("seed", ""),
    "case": ("case", ""),
    "occlusion": ("light", ""),
    "views": ("views", ""),
    "position_error": ("position error", ".2%"),
    "position_sd": ("stated", ".2%"),
    "noise_sd": ("at best", ".2%"),
    "held_out_psnr": ("PSNR (dB)", ".1f"),
    "guessed": ("guessed", ".1%"),
    "grade": ("grade", ""),
    "result": ("says", ""),
}

#: What the list of failures shows.
FAILURES = {"seed": ("seed", ""), "case": ("case", ""), "failed_in": ("stage", ""), "reason": ("reason", "")}

#: What properties are called.
PROPERTIES = {
    EVERYTHING: "all fits",
    "occlusion": "light",
    "stand": "cameras",
    "train_views": "training views",
    "lens": "lens, degrees",
    "unseen": "area unseen",
    "guessed": "guessed of what surfaces look at",
}


def page(table: pd.DataFrame, summary: pd.DataFrame) -> str:
    """The study as Markdown.

    Args:
        table: see `zoo.fits_table`.
        summary: of them, see `zoo.summary`.
    """
    parts = [f"# Rooms that nobody tuned\n\n{NOTE}\n\n![success and error]({FIGURE})\n"]
    for name, title in TITLES.items():
        chosen = table[table["part"] == name]
        if len(chosen):
            parts.append(f"## {title}\n\n{_figures(summary[summary['part'] == name])}")
            parts.append(f"### The rooms\n\n{markdown_table(_rooms(chosen), ROOMS)}")
            parts += _trouble(chosen)
    return "\n".join(parts)


def _figures(summary: pd.DataFrame) -> str:
    alike = several(summary, ["case", "method"])
    headings = [*alike, "property", "value", "views", "rooms", "fits", "solved", "position error"]
    headings += ["noise allows", "at best", "stated", "truth in 95 % region", "silent"]
    return markdown_lines(headings, [_cells(row, alike) for row in summary.to_dict("records")])


def _cells(row: Row, alike: list[str]) -> list[str]:
    value = LABELS.get(row["value"], str(row["value"]).replace("_", " "))
    cells = [str(row[name]) for name in alike] + [PROPERTIES.get(row["property"], row["property"]), value]
    cells += [str(row["views"]), str(row["rooms"]), str(row["count"])]
    cells += [with_interval(row, "success", 0), with_interval(row, "position", 2)]
    cells += [percent(row["noise_allows"], 0), percent(row["noise"])]
    return [*cells, percent(row["stated"]), percent(row["inside_95"], 0), with_interval(row, "silent", 0)]


def _rooms(table: pd.DataFrame) -> pd.DataFrame:
    """A row a room; where there are several cases, one for each."""
    rows = table.drop_duplicates(["seed", "case"]).sort_values("seed", kind="stable")
    return rows if several(rows, ["case"]) else rows.drop(columns="case")


def _trouble(table: pd.DataFrame) -> list[str]:
    """Lists of silent errors, of misleading grades and of rooms that failed; empty where there are none."""
    failed = table[table["result"] == FAILED].drop_duplicates(["seed", "case", "reason"])
    failed = failed.assign(reason=failed["reason"].str.replace("|", r"\|"))
    lists = (
        ("Wrong without a word", table[table["silent"]], WRONG),
        (f"Graded good, and off by more than {MISLED:.0%}".replace("%", " %"), misled(table), WRONG),
        ("Rooms that failed", failed, FAILURES),
    )
    return [f"### {title}\n\n{markdown_table(rows, shown)}" for title, rows, shown in lists if len(rows)]
