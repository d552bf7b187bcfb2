"""The training stage hands the configuration on and shows held-out views from the worst to the best."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from rgspipe.config import TrainConfig
from rgspipe.datasets.views import View
from rgspipe.scene import Camera, look_at
from rgspipe.stages.train_surfels import SHOWN_VIEWS, _write_comparison, train_options
from rgspipe.training.validate import HeldOut


def test_every_option_comes_from_the_configuration() -> None:
    config = TrainConfig(rounds=3, steps=5, views_per_step=2, edge_pixels=7, interior_pixels=11, subsamples=2, seed=9)
    options = train_options(config)
    assert (options.rounds, options.seed, options.gather_rays) == (3, 9, config.gather_rays)
    refine = options.refine
    assert (refine.steps, refine.views_per_step, refine.edge_pixels, refine.interior_pixels) == (5, 2, 7, 11)
    assert (refine.subsamples, refine.seed) == (2, 9)


@pytest.mark.parametrize("count", [1, 2, 5, 24])
def test_the_comparison_shows_a_few_views_whatever_their_number(tmp_path: Path, count: int) -> None:
    pose = look_at(torch.tensor([0.0, -2.0, 0.0]), torch.zeros(3))
    camera = Camera.from_field_of_view(pose, 1.0, 8, 8)
    views = tuple(View(f"test/{k}", camera, torch.full((8, 8, 3), 0.5), torch.ones(8, 8)) for k in range(count))
    images = tuple(np.full((8, 8, 3), 0.4, np.float32) for _ in views)
    psnr = np.linspace(20.0, 40.0, count)
    _write_comparison(tmp_path / "comparison.png", HeldOut(tuple(v.name for v in views), images, psnr, psnr), views)
    width, height = Image.open(tmp_path / "comparison.png").size
    shown = min(count, SHOWN_VIEWS)
    columns = 2 if shown % 2 == 0 else 1
    assert width >= columns * 3 * 8 and height >= (shown // columns) * 8
