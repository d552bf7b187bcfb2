"""The training stage hands the configuration on."""

from __future__ import annotations

from dataclasses import fields

import pytest

from rgspipe.config import RgspipeConfig, TrainConfig
from rgspipe.errors import InputError
from rgspipe.stages.train_surfels import STAGE, train_options


def test_every_option_comes_from_the_configuration() -> None:
    config = TrainConfig(rounds=3, steps=5, views_per_step=2, edge_pixels=7, interior_pixels=11, subsamples=2, seed=9)
    config.light_rounds, config.at_pixels, config.memory_mib = 2, False, 12.0
    options = train_options(config)
    assert (options.rounds, options.seed, options.gather_rays) == (3, 9, config.gather_rays)
    assert (options.light_rounds, options.at_pixels, options.memory_mib) == (2, False, 12.0)
    refine = options.refine
    assert (refine.steps, refine.views_per_step, refine.edge_pixels, refine.interior_pixels) == (5, 2, 7, 11)
    assert (refine.subsamples, refine.seed) == (2, 9)


def test_options_of_shading_loss_and_regularisers_come_from_the_configuration() -> None:
    names = ("relight_every", "window", "tilt_rate", "height_rate", "continuity_weight", "smoothness_weight")
    names += ("distortion_weight", "alpha_weight")
    values = {name: index + 1 for index, name in enumerate(names)}
    config = TrainConfig(**values, loss="l1", ssim_weight=0.3, compression=4.0, photometric_rounds=3, growth=1.5)
    options = train_options(config)
    assert {name: getattr(options.refine, name) for name in names} == values
    loss = options.refine.loss
    assert (loss.kind, loss.ssim_weight, loss.compression) == ("l1", 0.3, 4.0)
    assert (options.photometric.rounds, options.density.growth) == (3, 1.5)


def test_a_training_can_be_resumed_with_less_memory() -> None:
    keys = STAGE.keys(RgspipeConfig())
    assert "train.memory_mib" not in keys and "train.checkpoint_every" not in keys
    assert {f"train.{key.name}" for key in fields(TrainConfig)} - set(keys) == {
        "train.memory_mib",
        "train.checkpoint_every",
    }


def test_ssim_of_single_pixels_is_refused_with_a_remedy() -> None:
    with pytest.raises(InputError, match=r"train\.window=48"):
        train_options(TrainConfig(loss="l1_ssim"))
    assert train_options(TrainConfig(loss="l1_ssim", window=48)).refine.window == 48
