"""Suns from images to their answer: on an object, through an opening, and into a closed room."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import torch

from lit_room import VISIBLE, frozen_cube
from open_room import frozen_open_room, open_room_cameras
from rgspipe.datasets.light_file import read_lights
from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.fitting import FitResult, FitStatus, FitViews, LightSpec, PaperAdam
from rgspipe.fitting.findings import NoOpening
from rgspipe.scene import Camera, PointLight
from rgspipe.scene.lights import SunLight

COLOUR = [1.0, 2.0, 0.5]


def sun(*axis: float) -> SunLight:
    return SunLight([0.0, 0.0, 0.0], COLOUR, torch.nn.functional.normalize(torch.tensor(axis).double(), dim=0))


@pytest.fixture(scope="module")
def cube() -> FitViews:
    camera = Camera.look_at([1.2, -1.0, 0.9], [0.0, 0.0, 0.0], fov_degrees=40, width=32, height=32)
    return FitViews.prepare(frozen_cube(), [camera], lights="sun")


def fitted(views: FitViews, *truth: SunLight) -> tuple[FitResult, float]:
    """And how far the worst direction is off, rad."""
    result = views.fit(views.render(truth))
    return result, rig_errors(result.lights, truth, views.prepared.frozen.size).position


def test_direction_and_irradiance_are_found_on_an_object(cube: FitViews, tmp_path: Path) -> None:
    truth = sun(-0.5, 0.4, -0.6)
    result, error = fitted(cube, truth)
    assert result.status is FitStatus.CONVERGED and error < 1e-6  # measured 3e-8
    torch.testing.assert_close(result.lights[0].intensity, truth.intensity.double(), rtol=1e-6, atol=0.0)
    assert result.covariance[0].shape == (9, 9) and bool(torch.isfinite(result.covariance[0]).all())
    assert "sun axis (" in str(result) and "W/unit²" in str(result)
    result.save(tmp_path / "lights.json")
    assert read_lights(tmp_path / "lights.json")[0].columns() == result.lights[0].columns()


def test_a_sun_that_one_face_shows_is_not_determined(cube: FitViews) -> None:
    """A plane tells one number a channel of a direction and a strength."""
    camera = Camera.look_at([0.0, 0.0, 1.2], [0.0, 0.0, 0.25], fov_degrees=15, width=16, height=16)
    above = FitViews.prepare(cube.prepared.frozen, [camera], lights="sun")
    result, _ = fitted(above, sun(-0.3, 0.2, -0.9))
    assert result.status in (FitStatus.UNDETERMINED, FitStatus.AMBIGUOUS)


def test_a_sun_through_an_opening_is_found() -> None:
    views = FitViews.prepare(frozen_open_room(), open_room_cameras(32)[:2], lights="sun")
    result, error = fitted(views, sun(0.3, 0.7, -0.5))
    assert result.status is FitStatus.CONVERGED and math.degrees(error) < 1e-3


def test_a_sun_that_draws_nearly_the_shadow_of_another_is_found() -> None:
    """Two minima 2.6° apart, nearer than starts are, in the plane through the edge that shadows come from."""
    views = FitViews.prepare(frozen_open_room(), open_room_cameras(40)[:2], lights="sun")
    result, error = fitted(views, sun(0.66, 0.16, 0.74))
    assert result.status is FitStatus.CONVERGED and error < 1e-6  # measured 6e-9


def test_no_sun_comes_into_a_closed_room(room) -> None:
    views = FitViews.prepare(room.frozen, room.views, lights="sun", sharp=False)
    result = views.fit(views.render(PointLight(VISIBLE, COLOUR)))
    assert not result.lights and NoOpening() in result.findings
    assert "no light comes in from outside" in str(result)


def test_the_paper_s_method_moves_no_suns(cube: FitViews) -> None:
    with pytest.raises(ValueError, match="one point"):
        cube.fit(cube.render(sun(-0.5, 0.4, -0.6)), solver=PaperAdam())


def test_two_suns_are_two(cube: FitViews) -> None:
    views = FitViews.prepare(cube.prepared.frozen, cube.prepared.views, lights=LightSpec("sun", count=2))
    result, error = fitted(views, sun(-0.9, 0.3, -0.5), sun(0.1, 0.9, -0.6))
    # Each of three faces tells the sum of two cosines a channel: of two suns less than there is to know.
    assert len(result.lights) == 2 and (result.status is not FitStatus.CONVERGED or error < 1e-3)
