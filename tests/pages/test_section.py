"""Parts of the report about what may or may not have been made."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from rgspipe.evaluation import images
from rgspipe.pages import report
from rgspipe.pages.gallery import Shot
from rgspipe.pages.section import Section
from rgspipe.pages.targets_figure import targets_figure
from rgspipe.scene import PointLight, SpotLight

PNG = images.png_bytes(np.random.default_rng(0).integers(0, 255, (8, 8, 3), dtype=np.uint8))


def test_the_report_shows_galleries_before_the_training_and_the_rest_after_the_fits(full_contents) -> None:
    shot = Shot("rig_0 <one>", "a target", PNG)
    gallery = Section("made", "Made targets", ["Two of them."], shots=[shot])
    track = Section(
        "track", "Lights that move", columns=["<Light", "Frames"], rows=[["light 1", "24"]], drawings=[shot]
    )
    contents = dataclasses.replace(full_contents, galleries=[gallery], sections=[track])
    page = report.render_report(contents)
    places = [
        page.index(f'id="{name}"') for name in ("scene", "generated", "made", "trained", "fits", "track", "targets")
    ]
    assert places == sorted(places)
    assert '<a href="#track">Lights that move</a>' in page
    assert "rig_0 &lt;one&gt;" in page and '<td class="text">light 1</td><td>24</td>' in page
    assert '<a href="#generated">Generated targets</a>' in page
    assert 'id="generated"' not in report.render_report(full_contents)


def test_lights_of_shown_targets_are_numbered_in_both_drawings_and_spots_have_an_axis() -> None:
    ones = torch.ones(3, dtype=torch.float64)
    point = PointLight(0.2 * ones, ones)
    spot = SpotLight(0.6 * ones, ones, torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64), "gaussian", 0.5, 0.1)
    cloud = np.random.default_rng(0).uniform(size=(300, 3))
    normals = np.tile([1.0, 0.0, 0.0], (300, 1))
    figure = targets_figure({"1": (point, spot), "2": (point,)}, [(spot,)], cloud, normals, np.zeros((2, 3)))
    for axis in figure.axes:
        assert [text.get_text() for text in axis.texts] == ["1", "1", "2"]
        axes = [line for line in axis.lines if line.get_linestyle() == "-"]
        assert len(axes) == 2
        x = axes[0].get_xdata()
        assert x[0] == pytest.approx(0.6) and x[1] > x[0]
