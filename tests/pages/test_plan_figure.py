"""The drawing of a dataset's cameras and lights."""

import numpy as np
import pytest

from rgspipe.evaluation.light_plot import CameraMark
from rgspipe.evaluation.plots import png_of
from rgspipe.pages.plan_figure import GUESSED, SEEN, plan_figure

CAMERA = CameraMark((0.5, -2.0, 0.5), (0.0, 1.0, 0.0), 0.7)


def _legend(figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_both_panels_have_one_scale_and_show_cameras_lights_and_classes():
    cloud = np.random.default_rng(0).uniform(size=(100, 3))
    targets = {"occluded": [[0.5, 0.5, 0.2]], "visible": [[0.2, 0.5, 0.5], [0.8, 0.5, 0.5]]}
    figure = plan_figure(cloud, None, [CAMERA] * 3, [[0.5, 0.5, 0.9]], targets, [CAMERA])
    assert _legend(figure) == [
        "camera of a training view",
        "light of a training view",
        "camera of the targets",
        "target’s light: visible",
        "target’s light: occluded",
    ]
    png_of(figure, dpi=50)
    above, side = figure.axes
    scales = [axis.get_window_extent().width / np.ptp(axis.get_xlim()) for axis in (above, side)]
    assert scales[0] == pytest.approx(scales[1], rel=0.02)  # 0.003 measured
    assert above.get_ylim()[0] < -2.0 < side.get_xlim()[1]


def test_what_no_camera_saw_has_a_colour_of_its_own():
    cloud, guessed = np.random.default_rng(0).uniform(size=(100, 3)), np.arange(100) < 30
    figure = plan_figure(cloud, None, [CAMERA] * 3, [], {}, (), guessed)
    drawn = [(line.get_color(), len(line.get_xdata())) for line in figure.axes[0].lines[:2]]
    assert drawn == [(SEEN, 70), (GUESSED, 30)]
    assert _legend(figure)[-1] == "surface that no camera saw, added"
    assert not any("no camera" in text for text in _legend(plan_figure(cloud, None, [CAMERA] * 3, [], {})))


def test_a_camera_far_away_does_not_shrink_the_rest():
    far = CameraMark((0.0, 1000.0, 0.0), (0.0, -1.0, 0.0), 0.7)
    figure = plan_figure(None, None, [CAMERA] * 99 + [far], [[0.5, 0.5, 0.9]], {})
    assert figure.axes[0].get_ylim()[1] < 10.0


def test_nothing_to_draw_is_said():
    with pytest.raises(ValueError, match="neither cameras nor lights"):
        plan_figure(None, None, [], [], {})
