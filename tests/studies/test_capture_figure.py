"""The figure of bad captures: drawn from the rows that it is given, and refused without any."""

import numpy as np
import pandas as pd
import pytest

from rgspipe.studies.capture_figure import capture_figure
from rgspipe.studies.captures import TRUTH


def _study(scenes: tuple[str, ...]) -> pd.DataFrame:
    rows = [
        {"scene": scene, "case": case, "psnr": 40.0 - 3 * k, "ssim": np.nan, "position_error": 0.003 * (k + 1)}
        for scene in scenes
        for k, case in enumerate(("clean", "depth_noise=0.01", TRUTH))
    ]
    return pd.DataFrame(rows)


def test_panels_are_there_for_what_was_measured() -> None:
    figure = capture_figure(_study(("cornell", "room")))
    assert [axis.get_title(loc="left") for axis in figure.axes] == ["PSNR (dB)", "light: position error (%)"]
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["clean", "depth noise=0.01"]
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["cornell", "room", "clean capture", TRUTH]
    # The cases, a stalk to each, and a line each for the clean case and for true surfels.
    lines = [list(line.get_xdata()) for line in figure.axes[0].lines[:5]]
    assert lines == [[40.0, 37.0], [40.0, 40.0], [40.0, 37.0], [40.0, 40.0], [34.0, 34.0]]


def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(ValueError, match="no rows"):
        capture_figure(_study(()))
