"""Spheres and panels from images to their answer: grown from points, with their sizes."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import torch

from lit_room import HIDDEN, VISIBLE
from rgspipe.datasets.light_file import read_lights
from rgspipe.errors import InputError
from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.fitting import FitResult, FitStatus, FitViews, LightSpec, PaperAdam
from rgspipe.scene import Light
from rgspipe.scene.lights import PanelLight, PointLight, SphereLight

COLOUR = [1.0, 2.0, 0.5]
SPHERE = LightSpec("sphere", shape_free=True)


def fit(room, truth: Light, spec: LightSpec, sharp: bool = False) -> FitResult:
    views = FitViews.prepare(room.frozen, room.views, lights=spec, sharp=sharp)
    return views.fit(views.render(truth))


@pytest.fixture(scope="module")
def fitted_sphere(room) -> Callable[[tuple[float, ...], float], FitResult]:
    """Of a place and radius, fitted once."""
    return cache(lambda place, radius: fit(room, SphereLight(place, COLOUR, radius), SPHERE))


@pytest.mark.parametrize("place", [VISIBLE, HIDDEN], ids=["visible", "hidden"])
@pytest.mark.parametrize("radius", [0.03, 0.08])
def test_place_and_radius_of_a_sphere_are_found(fitted_sphere, place: tuple[float, ...], radius: float) -> None:
    truth, result = SphereLight(place, COLOUR, radius), fitted_sphere(place, radius)
    errors = rig_errors(result.lights, (truth,), 1.0)
    assert isinstance(result.lights[0], SphereLight) and result.status is FitStatus.CONVERGED
    # Measured at most 3.4e-5, 4.5e-5 and 7e-4: a small one in sight, whose size changes next to nothing.
    assert errors.position < 1e-4 and errors.intensity < 2e-4 and errors.shape < 2e-3
    assert result.covariance[0].shape == (7, 7) and torch.isfinite(result.covariance[0]).all()


def test_a_known_radius_stays(room) -> None:
    truth = SphereLight(HIDDEN, COLOUR, 0.06)
    result = fit(room, truth, LightSpec("sphere", shape=SphereLight.shaped(0.06)))
    assert result.lights[0].radius == 0.06 and result.covariance[0].shape == (6, 6)
    assert rig_errors(result.lights, (truth,), 1.0).position < 1e-6  # measured 1e-8


def test_a_point_is_a_sphere_without_a_radius(room) -> None:
    truth = PointLight(HIDDEN, COLOUR)
    result = fit(room, truth, SPHERE)
    # The loss is flat towards a radius of 0, so steps end before the middle is quite there: measured 3e-5 and 1.6e-4,
    # where the stated error is 6e-4.
    assert result.lights[0].radius < 0.02
    assert float((result.lights[0].position - truth.position).norm()) < 5e-4


def test_a_panel_is_found_with_axis_sides_and_turn(room) -> None:
    truth = PanelLight([0.3, 0.3, 0.45], COLOUR, [0.0976, 0.1952, -0.9759], 0.2, 0.15, -0.4)
    result = fit(room, truth, LightSpec("panel", shape_free=True))
    (found,) = result.lights
    errors = rig_errors(result.lights, (truth,), 1.0)
    assert isinstance(found, PanelLight) and result.status is FitStatus.CONVERGED
    assert found == found.told
    # Measured 1.4e-8, 2e-6 degrees and 9e-8.
    assert errors.position < 1e-6 and errors.axis < 1e-4 and errors.shape < 1e-5
    assert math.isclose(float(found.power()[0] / truth.power()[0]), 1.0, rel_tol=1e-6)


def test_sharp_images_find_them_as_well(room) -> None:
    truth = SphereLight(VISIBLE, COLOUR, 0.06)
    result = fit(room, truth, SPHERE, sharp=True)
    errors = rig_errors(result.lights, (truth,), 1.0)
    assert errors.position < 1e-6 and errors.shape < 1e-5  # measured 8e-9 and 1.3e-8


def test_the_answer_is_printed_written_and_read(fitted_sphere, tmp_path: Path) -> None:
    result = fitted_sphere(HIDDEN, 0.08)
    assert "sphere at (" in str(result) and "radius 0.08" in str(result)
    result.save(tmp_path / "lights.json")
    (read,) = read_lights(tmp_path / "lights.json")
    assert read.columns() == result.lights[0].columns()


@pytest.mark.slow
@pytest.mark.parametrize("mounted", [False, True], ids=["free", "mounted"])
def test_a_panel_that_lies_in_the_ceiling_is_found(room, mounted: bool) -> None:
    truth = PanelLight([0.1, -0.2, 0.499], COLOUR, [0.0, 0.0, -1.0], 0.3, 0.15, 0.4)
    result = fit(room, truth, LightSpec("panel", shape_free=True, mount="surface" if mounted else "free"), sharp=True)
    errors = rig_errors(result.lights, (truth,), 1.0)
    assert result.status is FitStatus.CONVERGED
    # Measured 1e-8 of a free one; 1.2e-3 and 4e-3 of one on the ceiling's plane, which is 0.001 behind it.
    assert errors.position < 4e-3 and errors.axis < 0.01 and errors.shape < 0.01
    if mounted:
        assert errors.axis < 1e-5 and not bool(result.covariance[0][3:6].any())


def test_what_lights_hang_on_is_said_by_name_and_how_far_with_it() -> None:
    with pytest.raises(InputError, match=r"LightSpec\.mount: expected one of free, surface, ceiling"):
        LightSpec("sphere", mount="wall")
    for mount, distance in (("free", 0.1), ("ceiling", -0.1)):
        with pytest.raises(InputError, match=r"LightSpec\.distance: "):
            LightSpec("sphere", mount=mount, distance=distance)


def test_the_paper_s_method_takes_lights_in_one_point(room) -> None:
    views = FitViews.prepare(room.frozen, room.views, lights=LightSpec("sphere"), sharp=False)
    with pytest.raises(ValueError, match="one point"):
        views.fit(views.render(SphereLight(VISIBLE, COLOUR, 0.06)), solver=PaperAdam())
