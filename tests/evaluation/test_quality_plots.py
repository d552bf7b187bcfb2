"""Figures of quality: drawn from the rows that they are given, and refused without any."""

import pandas as pd
import pytest

from rgspipe.evaluation.error_split import KINDS
from rgspipe.evaluation.plots import png_of
from rgspipe.evaluation.quality_plots import KIND_COLOURS, KIND_LABELS, split_figure


def _split() -> pd.DataFrame:
    rows = []
    for surfels in ("trained", "truth"):
        for light in ("pixels", "centres"):
            for kind, pixels in zip(KINDS, (0.14, 0.04, 0.0, 0.82), strict=True):
                psnr = float("nan") if pixels == 0.0 else 30.0
                row = {"surfels": surfels, "light": light, "kind": kind}
                rows.append(row | {"pixels": pixels, "error": pixels, "psnr": psnr})
    return pd.DataFrame(rows)


def test_the_bars_say_their_total_in_decibels() -> None:
    figure = split_figure(_split())
    totals = [text.get_text() for text in figure.axes[0].texts]
    assert totals == ["30.0 dB"] * 4
    widths = [patch.get_width() for patch in figure.axes[0].patches]
    assert sum(widths) == pytest.approx(4 * 1e4 * 1e-3)
    assert len(png_of(figure)) > 5000


def test_every_kind_has_a_colour_and_words() -> None:
    assert set(KIND_COLOURS) == set(KIND_LABELS) == set(KINDS)


def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(ValueError, match="passes"):
        split_figure(_split().iloc[:0])
