"""Saturated photographs: their clipped values are no measurements, in materials, in geometry and in judging."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from painted_room import LIGHT, painted_box, painted_views
from rgspipe.datasets.views import View
from rgspipe.evaluation.held_out_views import render_held_out
from rgspipe.training.materials import build_frozen, fit_materials
from rgspipe.training.refine import RefineView


@pytest.fixture(scope="module")
def clipped() -> list[View]:
    """Photographs of a painted room of which a quarter of the values are clipped."""
    views = painted_views()
    white = float(torch.cat([view.image.reshape(-1) for view in views]).quantile(0.75))
    return [replace(view, image=view.image.clamp(max=white), saturated_from=white) for view in views]


def test_albedo_is_found_in_saturated_photographs(clipped: list[View]) -> None:
    truth = painted_box()
    start = replace(truth, albedo=torch.full_like(truth.albedo, 0.5))
    errors = []
    for views in (clipped, [replace(view, saturated_from=None) for view in clipped]):
        found = fit_materials(start, views, LIGHT).surfels.albedo
        errors.append(float((found - truth.albedo).abs().mean() / truth.albedo.mean()))
    # Measured: 0.0029, and 0.23 where clipped values count as they are.
    assert errors[0] < 0.006 and errors[1] > 20.0 * errors[0], errors


def test_clipped_values_push_no_geometry_that_is_as_bright(clipped: list[View]) -> None:
    view = clipped[0]
    image, saturated = view.image.reshape(-1, 3), view.saturated.reshape(-1, 3)
    alpha = view.alpha.reshape(-1)
    refined = RefineView(view.camera, image, alpha, None, alpha > 2.0, 1.0, saturated)
    for factor, pushed in ((1.5, ~saturated), (0.5, image > 0.0)):
        rendered = (factor * image).requires_grad_()
        error = (refined.as_photographed(torch.arange(len(image)), rendered) - image).square().sum()
        error.backward()
        assert torch.equal(rendered.grad != 0.0, pushed & (image > 0.0))


def test_held_out_views_are_judged_as_they_were_photographed(clipped: list[View]) -> None:
    truth = painted_box()
    transport = build_frozen(truth, LIGHT).transport
    arguments = (transport, LIGHT.supersampling, LIGHT.at_pixels)
    known = render_held_out(truth, clipped[:2], *arguments)
    naive = render_held_out(truth, [replace(view, saturated_from=None) for view in clipped[:2]], *arguments)
    # Measured: the same arithmetic up to rounding (148 dB), and 24 to 30 dB where clipped values count as they are.
    assert known.psnr.min() > 100.0 and naive.psnr.max() < 35.0
