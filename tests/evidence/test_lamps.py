"""Lamps that were written in other axes or units are told by which surfaces are bright; true ones are left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from misread_views import lit_view
from raycast import room_views
from rgspipe.datasets.views import View
from rgspipe.evidence.lamps import READINGS, STATED, misplaced
from rgspipe.scene import PointLight


@pytest.fixture(scope="module")
def room() -> list[View]:
    """Twenty-four views, each with a lamp of its own."""
    generator = np.random.default_rng(5)
    lamps = [PointLight(generator.uniform(-0.35, 0.35, 3), 1.0) for _ in range(24)]
    return [lit_view(view, lamp, generator) for view, lamp in zip(room_views(24, 24, normals=True), lamps, strict=True)]


@pytest.mark.parametrize("meant", READINGS[1:], ids=lambda lamps: lamps.words)
def test_what_was_meant_is_told(room: list[View], meant: object) -> None:
    places = [_written(view, meant) for view in room]
    written = [
        replace(view, light=PointLight(places[(index - meant.frame) % len(room)], 1.0))
        for index, view in enumerate(room)
    ]
    finding = misplaced(written)
    assert finding is not None and finding.lamps == meant
    # Measured: 0.822, beside −0.10 to 0.42.
    assert finding.found > 0.75 and finding.stated < 0.5, finding


def _written(view: View, meant: object) -> np.ndarray:
    """The place that `meant` takes to the lamp's own: all of them are affine."""
    pose = view.camera.camera_to_world.numpy()
    shift = meant.place(np.zeros(3), pose)
    matrix = np.stack([meant.place(axis, pose) - shift for axis in np.eye(3)], axis=1)
    return np.linalg.solve(matrix, view.light.position.numpy() - shift)


def test_true_lamps_are_left_alone(room: list[View]) -> None:
    assert misplaced(room) is None
    assert _written(room[0], STATED) == pytest.approx(room[0].light.position.numpy())


def test_lamps_that_are_roughly_right_are_left_alone(room: list[View]) -> None:
    generator = np.random.default_rng(0)
    rough = [
        replace(view, light=PointLight(view.light.position + 0.1 * torch.from_numpy(generator.standard_normal(3)), 1.0))
        for view in room
    ]
    assert misplaced(rough) is None


def test_images_that_other_lamps_light_are_told(room: list[View]) -> None:
    """They passed: no other reading of the places was any better."""
    shuffled = [replace(view, image=other.image) for view, other in zip(room, [*room[5:], *room[:5]], strict=True)]
    finding = misplaced(shuffled)
    # Measured: 0.02, beside 0.82 of the true ones.
    assert finding is not None and finding.lamps is None and abs(finding.stated) < 0.1
    assert misplaced(shuffled[:9]) is None


def test_images_of_one_brightness_tell_nothing(room: list[View]) -> None:
    assert misplaced([replace(view, image=torch.ones_like(view.image)) for view in room]) is None
    assert misplaced(room[:2]) is None and misplaced([]) is None
