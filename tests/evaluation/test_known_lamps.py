"""A scene is asked for lamps whose places are known, and its own errors are what it finds them off by."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import HIDDEN, VISIBLE, frozen_room, room_cameras
from rgspipe.datasets.views import View
from rgspipe.evaluation.known_lamps import MOST_LAMPS, error_of_known_lamps
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight


def views_of(scene: FrozenScene, places: list[tuple[float, float, float]]) -> list[View]:
    camera = room_cameras(48)[0]
    lamps = [PointLight(place, (1.0, 1.0, 1.0)) for place in places]
    alpha = torch.ones(48, 48)
    return [View(f"r_{n}", camera, scene.render(camera, lamp).detach(), alpha, lamp) for n, lamp in enumerate(lamps)]


def test_a_scene_without_errors_finds_lamps_where_they_are() -> None:
    scene = frozen_room()
    error, count = error_of_known_lamps(scene, views_of(scene, [VISIBLE, HIDDEN]))
    assert count == 2 and error < 1e-6  # Measured 0: no step makes it better.


def test_a_scene_with_errors_is_told_by_what_it_finds() -> None:
    """A gradient in the albedo moves the lamp that explains the image, and twice the slope about twice as far."""
    scene = frozen_room()
    (view,) = views_of(scene, [VISIBLE])
    errors = [error_of_known_lamps(tilted(scene, slope), [view])[0] for slope in (0.05, 0.1)]
    # Measured 0.0096 and 0.0208.
    assert errors[0] > 1e-3 and errors[1] == pytest.approx(2.0 * errors[0], rel=0.2)


def tilted(scene: FrozenScene, slope: float) -> FrozenScene:
    """The scene with an albedo that is wrong by e^(slope·x)."""
    albedo = scene.surfels.albedo * torch.exp(slope * scene.surfels.centers[:, :1])
    return FrozenScene.freeze(replace(scene.surfels, albedo=albedo), gather_rays=64, patches=150)


def test_lamps_are_few_and_those_that_nothing_is_known_of_do_not_count() -> None:
    scene = frozen_room()
    (view,) = views_of(scene, [VISIBLE])
    dark = replace(view, image=torch.zeros_like(view.image))
    assert error_of_known_lamps(scene, [dark, replace(view, light=None)]) == (None, 0)
    assert error_of_known_lamps(scene, [view] * (MOST_LAMPS + 1))[1] <= MOST_LAMPS
