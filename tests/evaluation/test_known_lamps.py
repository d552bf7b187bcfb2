"""A scene is asked for lamps whose places are known, and its own errors are what it finds them off by."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest
import torch

from lit_room import HIDDEN, VISIBLE, frozen_room, room_cameras
from rgspipe.datasets.views import View
from rgspipe.evaluation.known_lamps import known_lamps, told_lamps
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight


def views_of(scene: FrozenScene, places: list[tuple[float, float, float]]) -> list[View]:
    camera = room_cameras(48)[0]
    lamps = [PointLight(place, (1.0, 1.0, 1.0)) for place in places]
    alpha = torch.ones(48, 48)
    return [View(f"r_{n}", camera, scene.render(camera, lamp).detach(), alpha, lamp) for n, lamp in enumerate(lamps)]


def test_a_scene_without_errors_finds_lamps_where_they_are() -> None:
    scene = frozen_room()
    found = known_lamps(scene, views_of(scene, [VISIBLE, HIDDEN]))
    assert list(found["name"]) == ["r_0", "r_1"] and set(found["result"]) == {"converged"}
    assert found["error"].max() < 1e-6  # Measured 0: no step makes it better.
    assert told_lamps(found).startswith("judge: 2 of 2 lamps of views that were left out are found")


def test_a_scene_with_errors_is_told_by_what_it_finds() -> None:
    """A gradient in the albedo moves the lamp that explains the image, and twice the slope about twice as far."""
    scene = frozen_room()
    views = views_of(scene, [VISIBLE])
    errors = [float(known_lamps(tilted(scene, slope), views)["error"].iloc[0]) for slope in (0.05, 0.1)]
    # Measured 0.0096 and 0.0208.
    assert errors[0] > 1e-3 and errors[1] == pytest.approx(2.0 * errors[0], rel=0.2)


def tilted(scene: FrozenScene, slope: float) -> FrozenScene:
    """The scene with an albedo that is wrong by e^(slope·x)."""
    albedo = scene.surfels.albedo * torch.exp(slope * scene.surfels.centers[:, :1])
    return FrozenScene.freeze(replace(scene.surfels, albedo=albedo), gather_rays=64, patches=150)


def test_views_that_tell_nothing_have_no_row() -> None:
    """Black ones, those without a lamp, and those that show nothing of the scene."""
    scene = frozen_room()
    (view,) = views_of(scene, [VISIBLE])
    black, unlit = replace(view, image=torch.zeros_like(view.image)), replace(view, light=None)
    none = known_lamps(scene, [black, unlit, replace(view, alpha=torch.zeros_like(view.alpha))])
    assert not len(none) and "no lamp" in told_lamps(none)


def test_lamps_that_a_fit_does_not_claim_to_have_found_do_not_count() -> None:
    rows = [("a", 0.03, 0.01, "converged"), ("b", 0.5, 0.9, "undetermined"), ("c", 0.04, 0.01, "converged")]
    words = told_lamps(pd.DataFrame(rows, columns=["name", "error", "stated", "result"]))
    assert "2 of 3 lamps" in words and "3.5 % of the scene off" in words and "4.0 % in c" in words
