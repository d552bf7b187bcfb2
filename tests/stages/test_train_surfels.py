"""The training stage hands the configuration on."""

from __future__ import annotations

from rgspipe.config import TrainConfig
from rgspipe.stages.train_surfels import train_options


def test_every_option_comes_from_the_configuration() -> None:
    config = TrainConfig(rounds=3, steps=5, views_per_step=2, edge_pixels=7, interior_pixels=11, subsamples=2, seed=9)
    config.light_rounds, config.at_pixels = 2, False
    options = train_options(config)
    assert (options.rounds, options.seed, options.gather_rays) == (3, 9, config.gather_rays)
    assert (options.light_rounds, options.at_pixels) == (2, False)
    refine = options.refine
    assert (refine.steps, refine.views_per_step, refine.edge_pixels, refine.interior_pixels) == (5, 2, 7, 11)
    assert (refine.subsamples, refine.seed) == (2, 9)
