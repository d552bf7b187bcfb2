"""Held-out views of a scene that is the truth itself."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from lit_room import VISIBLE, room_cameras, room_surfels
from rgspipe.datasets.views import View
from rgspipe.evaluation.held_out_views import HeldOut, render_held_out
from rgspipe.scene import PointLight, Surfels
from rgspipe.training.materials import build_frozen
from rgspipe.training.options import TrainOptions

OPTIONS = TrainOptions(gather_rays=64, patches=100)


@pytest.fixture(scope="module")
def surfels() -> Surfels:
    return room_surfels().to(torch.float32)


def _rendered(surfels: Surfels) -> HeldOut:
    light = PointLight(torch.tensor(VISIBLE, dtype=torch.float64), torch.ones(3, dtype=torch.float64))
    blank = [
        View(f"test/{k}", camera, torch.zeros(24, 24, 3), torch.ones(24, 24), light)
        for k, camera in enumerate(room_cameras(24))
    ]
    return render_held_out(surfels, blank, build_frozen(surfels, OPTIONS).transport, 1)


def test_a_scene_that_made_the_images_itself_is_without_error(surfels: Surfels) -> None:
    first = _rendered(surfels)
    views = [
        replace(view, image=torch.from_numpy(image), albedo=torch.from_numpy(albedo))
        for view, image, albedo in zip(first.views, first.images, first.albedo, strict=True)
    ]
    again = render_held_out(surfels, views, build_frozen(surfels, OPTIONS).transport, 1)
    assert again.psnr.min() > 100.0  # measured inf: the same arithmetic
    summary = again.summary()
    assert summary["test_flip_max"] == 0.0 and summary["albedo"]["relative_l1"] == 0.0
    assert [row["name"] for row in summary["per_view"]] == ["test/0", "test/1"]
    json.dumps(summary, allow_nan=False)


def test_rendered_albedo_is_the_surfels_albedo_whatever_the_light(surfels: Surfels) -> None:
    for image in _rendered(surfels).albedo:
        covered = image.sum(axis=-1) > 0.1
        assert covered.mean() > 0.9
        assert np.allclose(image[covered], [0.6, 0.5, 0.4], atol=1e-5)  # measured 1e-7


def test_without_passes_there_is_no_figure_off_edges(surfels: Surfels) -> None:
    assert np.isnan(_rendered(surfels).psnr_off_edges).all()
