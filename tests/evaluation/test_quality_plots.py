"""Figures of quality: drawn from the rows that they are given, and refused without any."""

import numpy as np
import pandas as pd
import pytest

from rgspipe.evaluation.error_split import KINDS
from rgspipe.evaluation.plots import png_of
from rgspipe.evaluation.quality_plots import KIND_COLOURS, KIND_LABELS, split_figure, study_figure
from rgspipe.evaluation.study import TRUTH


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


def _study(scenes: tuple[str, ...]) -> pd.DataFrame:
    rows = [
        {"scene": scene, "case": case, "psnr": 40.0 - 3 * k, "ssim": np.nan, "position_error": 0.003 * (k + 1)}
        for scene in scenes
        for k, case in enumerate(("clean", "depth_noise=0.01", TRUTH))
    ]
    return pd.DataFrame(rows)


def test_panels_are_there_for_what_was_measured() -> None:
    figure = study_figure(_study(("cornell", "room")))
    assert [axis.get_title(loc="left") for axis in figure.axes] == ["PSNR (dB)", "light: position error (%)"]
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["clean", "depth noise=0.01"]
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["cornell", "room", "clean capture", TRUTH]
    # The cases, a stalk to each, and a line each for the clean case and for true surfels.
    lines = [list(line.get_xdata()) for line in figure.axes[0].lines[:5]]
    assert lines == [[40.0, 37.0], [40.0, 40.0], [40.0, 37.0], [40.0, 40.0], [34.0, 34.0]]


def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(ValueError, match="passes"):
        split_figure(_split().iloc[:0])
    with pytest.raises(ValueError, match="no rows"):
        study_figure(_study(()))
