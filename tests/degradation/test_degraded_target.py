"""Targets of a worse camera."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from lit_room import room_cameras
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_target import captured
from rgspipe.degradation.options import TargetErrors
from rgspipe.scene import srgb


@pytest.fixture(scope="module")
def views() -> list[View]:
    generator = torch.Generator().manual_seed(0)
    images = [3.0 * torch.rand(32, 32, 3, generator=generator) for _ in range(2)]
    pairs = zip(room_cameras(32), images, strict=True)
    return [View(f"v{k}", camera, image, torch.ones(32, 32)) for k, (camera, image) in enumerate(pairs)]


def test_a_perfect_camera_changes_nothing(views: list[View]) -> None:
    taken, clip = captured(views, "one", TargetErrors(seed=3))
    assert clip is None and all(torch.equal(a.image, b.image) for a, b in zip(taken, views, strict=True))


def test_eight_bits_clip_at_the_quantile_and_hold_srgb_levels_of_the_white(views: list[View]) -> None:
    taken, clip = captured(views, "one", TargetErrors(white=0.9))
    values = torch.cat([view.image.reshape(-1) for view in taken]).double()
    assert clip == pytest.approx(float(torch.cat([v.image.reshape(-1) for v in views]).double().quantile(0.9)))
    assert float((values >= clip * (1 - 1e-6)).double().mean()) == pytest.approx(0.1, abs=0.01)
    levels = 255.0 * srgb.encode(values.numpy() / clip)
    assert float(np.abs(levels - np.round(levels)).max()) < 1e-3
    below = views[0].image < 0.99 * clip
    # Half a level near white: 2.275/255/2.
    assert float((taken[0].image - views[0].image)[below].abs().max()) < 0.0046 * clip


def test_the_first_view_keeps_its_exposure_and_the_others_have_one_of_their_own(views: list[View]) -> None:
    factors = []
    for name in (str(k) for k in range(200)):
        taken, _ = captured(views, name, TargetErrors(exposure=0.5))
        assert torch.equal(taken[0].image, views[0].image)
        factors.append(math.log2(float(taken[1].image.mean() / views[1].image.mean())))
    assert float(np.std(factors)) == pytest.approx(0.5, rel=0.15)


def test_draws_depend_on_the_seed_and_the_target_alone(views: list[View]) -> None:
    options = TargetErrors(noise=0.05, exposure=1.0, seed=1)
    first, again = (captured(views, "a", options)[0] for _ in range(2))
    other = captured(views, "b", options)[0]
    seeded = captured(views, "a", TargetErrors(noise=0.05, exposure=1.0, seed=2))[0]
    assert torch.equal(first[1].image, again[1].image)
    assert not torch.equal(first[1].image, other[1].image) and not torch.equal(first[1].image, seeded[1].image)


def test_noise_has_the_stated_size(views: list[View]) -> None:
    taken, _ = captured(views, "a", TargetErrors(noise=0.05))
    bright = views[0].image > 1.5
    relative = ((taken[0].image - views[0].image) / views[0].image)[bright]
    assert float(relative.std()) == pytest.approx(0.05, rel=0.1)  # with a tenth of it in the dark: measured 0.051
