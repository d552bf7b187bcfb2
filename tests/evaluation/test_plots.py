"""Figures draw, are reproducible, and refuse what they cannot draw."""

import math

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from rgspipe.evaluation import plots


def test_figures_are_reproducible_files(fitted):
    targets, curves = fitted(1)
    for figure in (plots.convergence_figure, plots.error_figure):
        data = curves if figure is plots.convergence_figure else targets
        first = plots.svg_bytes(figure(data))
        assert first.startswith(b"<?xml") and b"nan" not in first
        assert first == plots.svg_bytes(figure(data))


def test_failed_fits_are_drawn_at_the_border(fitted):
    targets, _ = fitted(1)
    targets.loc[0, ["x", "y", "z", "position_error", "intensity_error"]] = [math.nan] * 3 + [math.inf] * 2
    assert plots.error_figure(targets).axes[0].get_ylim()[1] < 10.0


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
    assert min(np.diff(grey)) > 20  # of 255; measured 25


def _luminance(colour: str) -> int:
    return Image.new("RGB", (1, 1), colour).convert("L").getpixel((0, 0))
