"""Figures draw, are reproducible, and refuse what they cannot draw."""

import math

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Ellipse
from PIL import Image

from rgspipe.evaluation import plots
from rgspipe.evaluation.tables import VARIANCES


def test_figures_are_reproducible_files(fitted):
    targets, curves = fitted(1)
    for figure in (plots.convergence_figure, plots.error_figure):
        data = curves if figure is plots.convergence_figure else targets
        first = plots.svg_bytes(figure(data))
        assert first.startswith(b"<?xml") and b"nan" not in first
        assert first == plots.svg_bytes(figure(data))


def test_failed_fits_and_estimates_far_away_are_drawn_at_the_border(fitted):
    targets, _ = fitted(1)
    targets.loc[0, ["x", "y", "z", "position_error", "intensity_error"]] = [math.nan] * 3 + [math.inf] * 2
    targets.loc[1, "x"] = 50.0
    cloud = np.random.default_rng(0).uniform(size=(20, 3))
    figure = plots.light_figure(targets, cloud)
    above = figure.axes[0]
    assert above.get_xlim()[1] < 1.5 and "2 estimates lie outside" in above.get_title(loc="left")
    assert plots.error_figure(targets).axes[0].get_ylim()[1] < 10.0


def test_cameras_far_away_are_drawn_on_their_line_of_sight_near_the_scene(fitted):
    targets, _ = fitted(1)
    cloud = np.random.default_rng(0).uniform(size=(200, 3))
    far = plots.CameraMark((0.5, -30.0, 0.5), (0.0, 1.0, 0.0), 0.7)
    away = plots.CameraMark((0.5, -0.2, 0.5), (0.0, -1.0, 0.0), 0.7)
    above, side = plots.light_figure(targets, cloud, cameras=[far, away]).axes
    assert -0.6 < above.get_ylim()[0] < -0.2  # the scene's box begins near 0, cameras reach 0.3 further
    assert side.get_xlabel().startswith("y")  # the cameras look along y, so a side view shows y


def test_regions_are_drawn_as_their_outline_in_both_views(fitted):
    """A region that is long along y is long across from the side, where y runs across, and up from above."""
    targets, _ = fitted(1)
    targets.loc[:, list(VARIANCES)] = [1e-4, 0.0, 0.0, 1e-2, 0.0, 4e-4]
    above, side = plots.light_figure(targets, np.random.default_rng(0).uniform(size=(20, 3))).axes
    radius = math.sqrt(7.8147)  # of the 95 % region, in standard deviations
    for axis, lengths in ((above, (0.01, 0.1)), (side, (0.1, 0.02))):
        outlines = [patch for patch in axis.patches if isinstance(patch, Ellipse)]
        assert len(outlines) == len(targets)
        corners = outlines[0].get_corners() - outlines[0].center
        size = 2.0 * np.abs(corners).max(axis=0)
        assert size == pytest.approx(2.0 * radius * np.array(lengths), rel=1e-3)
    targets.loc[:, "var_xx"] = math.inf
    above, side = plots.light_figure(targets, np.random.default_rng(0).uniform(size=(20, 3))).axes
    assert not [patch for patch in above.patches if isinstance(patch, Ellipse)]


def test_light_figure_is_a_png_of_report_width(fitted):
    targets, _ = fitted(1)
    content = plots.png_of(plots.light_figure(targets, np.random.default_rng(0).uniform(size=(20, 3))), dpi=100)
    assert content.startswith(b"\x89PNG")
    assert 900 < int.from_bytes(content[16:20]) < 1100


def test_training_figure_does_without_seconds_and_psnr():
    figure = plots.training_figure(pd.DataFrame({"loss": [1.0, 0.5]}))
    assert figure.axes[0].get_xlabel() == "row of the log"
    assert "not recorded" in [text.get_text() for text in figure.axes[1].texts]


@pytest.mark.parametrize("draw", [plots.convergence_figure, plots.error_figure])
def test_nothing_to_draw_is_said(draw, fitted):
    targets, curves = fitted(1, with_truth=False)
    with pytest.raises(ValueError):
        draw(curves.iloc[:0] if draw is plots.convergence_figure else targets)


def test_convergence_without_truth_still_shows_the_loss(fitted):
    _, curves = fitted(1, with_truth=False)
    figure = plots.convergence_figure(curves)
    assert figure.axes[0].lines and "truth unknown" in [text.get_text() for text in figure.axes[1].texts]


def test_class_colours_stay_apart_in_grey():
    grey = sorted(_luminance(colour) for colour in plots.COLOURS.values())
    assert min(np.diff(grey)) > 20  # of 255; measured 27


def _luminance(colour: str) -> int:
    return Image.new("RGB", (1, 1), colour).convert("L").getpixel((0, 0))
