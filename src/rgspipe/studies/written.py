"""What every study writes: its rows, the same as people read them, and a figure."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from rgspipe.evaluation.plots import png_of

TABLE, TEXT, FIGURE = "study.csv", "study.md", "study.png"


def write_study(folder: Path, table: pd.DataFrame, text: str, figure: Figure) -> None:
    """Write study.csv, study.md (Markdown) and study.png into the folder."""
    table.to_csv(folder / TABLE, index=False)
    (folder / TEXT).write_text(text, encoding="utf-8")
    (folder / FIGURE).write_bytes(png_of(figure))
