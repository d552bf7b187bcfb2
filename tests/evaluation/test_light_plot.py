"""Lights in the scene are drawn where they are, with how sure that is and the cameras."""

import math

import numpy as np
import pytest
from matplotlib.patches import Ellipse

from rgspipe.evaluation import plots
from rgspipe.evaluation.light_plot import CameraMark, light_figure
from rgspipe.evaluation.tables import VARIANCES


def test_estimates_that_failed_or_are_far_away_are_counted_and_do_not_widen_the_drawing(fitted):
    targets, _ = fitted(1)
    targets.loc[0, ["x", "y", "z"]] = math.nan
    targets.loc[1, "x"] = 50.0
    above = light_figure(targets, np.random.default_rng(0).uniform(size=(20, 3))).axes[0]
    assert above.get_xlim()[1] < 1.5 and "2 estimates lie outside" in above.get_title(loc="left")


def test_cameras_far_away_are_drawn_on_their_line_of_sight_near_the_scene(fitted):
    targets, _ = fitted(1)
    cloud = np.random.default_rng(0).uniform(size=(200, 3))
    far = CameraMark((0.5, -30.0, 0.5), (0.0, 1.0, 0.0), 0.7)
    away = CameraMark((0.5, -0.2, 0.5), (0.0, -1.0, 0.0), 0.7)
    above, side = light_figure(targets, cloud, cameras=[far, away]).axes
    assert -0.6 < above.get_ylim()[0] < -0.2  # the scene's box begins near 0, cameras reach 0.3 further
    assert side.get_xlabel().startswith("y")  # the cameras look along y, so a side view shows y


def test_regions_are_drawn_as_their_outline_in_both_views(fitted):
    """A region that is long along y is long across from the side, where y runs across, and up from above."""
    targets, _ = fitted(1)
    targets.loc[:, list(VARIANCES)] = [1e-4, 0.0, 0.0, 1e-2, 0.0, 4e-4]
    above, side = light_figure(targets, np.random.default_rng(0).uniform(size=(20, 3))).axes
    radius = math.sqrt(7.8147)  # of the 95 % region, in standard deviations
    for axis, lengths in ((above, (0.01, 0.1)), (side, (0.1, 0.02))):
        outlines = [patch for patch in axis.patches if isinstance(patch, Ellipse)]
        assert len(outlines) == len(targets)
        corners = outlines[0].get_corners() - outlines[0].center
        size = 2.0 * np.abs(corners).max(axis=0)
        assert size == pytest.approx(2.0 * radius * np.array(lengths), rel=1e-3)
    targets.loc[:, "var_xx"] = math.inf
    above, side = light_figure(targets, np.random.default_rng(0).uniform(size=(20, 3))).axes
    assert not [patch for patch in above.patches if isinstance(patch, Ellipse)]


def test_light_figure_is_a_png_of_report_width(fitted):
    targets, _ = fitted(1)
    content = plots.png_of(light_figure(targets, np.random.default_rng(0).uniform(size=(20, 3))), dpi=100)
    assert content.startswith(b"\x89PNG")
    assert 900 < int.from_bytes(content[16:20]) < 1100
