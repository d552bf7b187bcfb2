"""What every study comes to, and the files it is written to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from rgspipe.evaluation.plots import png_of
from rgspipe.store.files import write_bytes, write_text

TABLE, TEXT, FIGURE = "study.csv", "study.md", "study.png"


@dataclass(frozen=True)
class Study:
    """What a study found.

    Attributes:
        table: its rows; `scene` says of which scene each is.
        text: the same as people read them, in Markdown.
        figure: the same drawn.
        beside: further files by their paths within the folder of the study.
    """

    table: pd.DataFrame
    text: str
    figure: Figure
    beside: Mapping[str, bytes] = field(default_factory=dict)


def write_study(folder: Path, kind: str, study: Study) -> None:
    """Write study.csv, study.md, study.png and what stands beside them into the folder.

    Args:
        kind: of the study; the first column of study.csv.
    """
    table = study.table.copy()
    table.insert(0, "kind", kind)
    write_text(folder / TABLE, table.to_csv(index=False))
    write_text(folder / TEXT, study.text)
    write_bytes(folder / FIGURE, png_of(study.figure))
    for name, content in study.beside.items():
        write_bytes(folder / name, content)
