"""The figure of the zoo: success and errors against what no camera saw and numbers of views."""

from __future__ import annotations

import numpy as np
import pytest

from rgspipe.evaluation.plots import ERROR_RANGE
from rgspipe.studies.zoo_figure import zoo_figure
from zoo_fits import five_rooms


def test_success_of_ranges_stands_over_errors_of_fits() -> None:
    figure = zoo_figure(five_rooms())
    solved, _, by_views, errors, _, errors_by_views = figure.axes
    assert [axis.get_xlabel() for axis in figure.axes[3:]] == [
        "area that no camera saw (%)",
        "guessed, of what surfaces look at (%)",
        "training views",
    ]
    points = {(round(float(x), 1), round(float(y), 1)) for line in solved.lines for x, y in line.get_xydata()}
    # One view: odd seeds 1 (10 %, two of three) and 3 (40 %, none), even seed 4 (all); three views 0.4 to the right.
    assert points == {(10.0, 66.7), (40.0, 0.0), (10.0, 100.0), (10.4, 66.7), (40.4, 0.0), (10.4, 100.0)}
    # A training that failed counts against its number of views; a room that could not be built counts nowhere.
    assert {round(float(x)) for line in by_views.lines for x in line.get_xdata()} == {30, 40, 60, 80}
    drawn = np.concatenate([line.get_ydata() for line in errors.lines if line.get_marker() != "None"])
    assert drawn.min() == pytest.approx(0.1) and len(drawn) == 24
    assert max(max(line.get_ydata()) for line in errors_by_views.lines) == 100.0 * ERROR_RANGE[1]
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["1 view", "3 views", "odd seeds (work)", "even seeds (final)"]


def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(ValueError, match="no rows"):
        zoo_figure(five_rooms().iloc[:0])
