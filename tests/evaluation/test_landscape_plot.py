"""Slices through the loss are kept whole and drawn, also where little is known of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rgspipe.datasets.landscape_file import PLANES, Landscape, PlaneLoss, landscape_bytes, read_landscape
from rgspipe.evaluation import plots
from rgspipe.evaluation.landscape_plot import landscape_figure

AXIS = np.linspace(-1.0, 1.0, 5)


def _landscape(loss: np.ndarray) -> Landscape:
    path = np.array([[0.5, 0.5, -0.5], [0.1, 0.2, 0.0], [0.0, 0.0, 0.0]])
    return Landscape({name: PlaneLoss(AXIS, AXIS + 3.0, loss) for name in PLANES}, path)


def test_a_landscape_is_read_as_it_was_written(tmp_path: Path) -> None:
    loss = AXIS[:, None] ** 2 + AXIS**2 + 0.01
    path = tmp_path / "landscape.npz"
    path.write_bytes(landscape_bytes(_landscape(loss)))
    found = read_landscape(path)
    for name in PLANES:
        np.testing.assert_array_equal(found.planes[name].loss, loss)
        np.testing.assert_array_equal(found.planes[name].up, AXIS + 3.0)
    assert found.trajectory.shape == (3, 3)


def test_three_planes_are_drawn_with_the_way_and_the_truth() -> None:
    figure = landscape_figure(_landscape(AXIS[:, None] ** 2 + AXIS**2 + 0.01), np.array([0.1, 0.0, 0.2]))
    assert [(axis.get_xlabel()[0], axis.get_ylabel()[0]) for axis in figure.axes] == [tuple(name) for name in PLANES]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["start", "steps", "answer", "truth"]
    assert "loss 0.01 to 2" in figure.axes[0].get_title(loc="left")
    assert plots.png_of(figure, dpi=50).startswith(b"\x89PNG")


@pytest.mark.parametrize("value", [0.0, 1.0, math.nan])
def test_a_flat_or_unknown_loss_is_drawn_without_contours(value: float) -> None:
    figure = landscape_figure(_landscape(np.full((5, 5), value)))
    assert not figure.axes[0].collections and len(figure.legends[0].get_texts()) == 3
    plots.png_of(figure, dpi=50)
