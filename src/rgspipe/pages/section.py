"""A part of the report about something that may or may not have been made: words, a table and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rgspipe.pages.gallery import Shot
from rgspipe.pages.html import picture_address

#: A drawing: bytes, and pixels across. A picture of a target is as small as those of the gallery.
DRAWING_BYTES, DRAWING_WIDTH = 300_000, 1400
SHOT_BYTES, SHOT_WIDTH = 80_000, 320


@dataclass(frozen=True)
class Section:
    """What a stage found, ready to be shown.

    Attributes:
        anchor: name in addresses.
        title: of the section.
        words: paragraphs.
        columns: headings of the table; those that start with "<" are of words.
        rows: their cells.
        note: what stands below the table.
        drawings: large pictures.
        shots: small ones, side by side.
        remark: what the reader must know of where it comes from, or "".
    """

    anchor: str
    title: str
    words: Sequence[str] = ()
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    note: str = ""
    drawings: Sequence[Shot] = ()
    shots: Sequence[Shot] = ()
    remark: str = ""


def shown_sections(sections: Sequence[Section]) -> list[dict[str, Any]]:
    """Sections as the template takes them, pictures as addresses."""
    return [_shown(section) for section in sections]


def _shown(section: Section) -> dict[str, Any]:
    columns = [{"name": name.removeprefix("<"), "text": name.startswith("<")} for name in section.columns]
    return {
        "section": section,
        "columns": columns,
        "rows": [list(zip(columns, row, strict=True)) for row in section.rows],
        "drawings": [_address(shot, DRAWING_BYTES, DRAWING_WIDTH) for shot in section.drawings],
        "shots": [_address(shot, SHOT_BYTES, SHOT_WIDTH) for shot in section.shots],
    }


def _address(shot: Shot, budget: int, width: int) -> dict[str, Any]:
    return {"caption": shot.caption, "alt": shot.alt, "source": picture_address(shot.png, budget, width)}
