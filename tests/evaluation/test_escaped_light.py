"""Light that leaves a scene is missing where no camera saw that nothing is there, and only there."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
import torch

from half_seen_room import only
from rgspipe.evaluation.escaped_light import Escaped, escaped_light
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera
from rooms import closed_box


def camera(eye: Sequence[float], target: Sequence[float], degrees: float = 100.0) -> Camera:
    return Camera.look_at(eye, target, fov_degrees=degrees, width=32, height=32)


def escaped(kept: torch.Tensor | None, *cameras: Camera) -> Escaped:
    """What escapes from a cube from −0.5 to 0.5, of which only some surfels are kept."""
    box = closed_box(0.1)
    box = box if kept is None else only(box, kept)
    return escaped_light(FrozenScene.freeze(box, gather_rays=16, patches=20), cameras)


@pytest.fixture(scope="module")
def without_wall() -> torch.Tensor:
    """Surfels of a cube whose wall at x = −0.5 is missing."""
    return closed_box(0.1).normals[:, 0] < 0.9


def test_nothing_leaves_a_closed_room() -> None:
    # Measured 7e-5: one ray between the surfels of an edge.
    assert float(escaped(None, camera([0, 0, 0], [0.5, 0, 0])).shares.sum()) < 1e-3


def test_a_wall_that_no_camera_looked_at_is_missing(without_wall: torch.Tensor) -> None:
    found = escaped(without_wall, camera([-0.3, 0, 0], [0.5, 0, 0]))
    # A wall of a cube fills 0.2 of what the other five see.
    assert float(found.shares.sum()) == pytest.approx(0.2, abs=0.02)  # measured 0.195
    middle = (found.places * found.shares[:, None]).sum(dim=0) / found.shares.sum()
    # The box around what is left ends at the middles of the last surfels, x = −0.45.
    assert torch.allclose(middle, torch.tensor([-0.5, 0.0, 0.0], dtype=torch.float64), atol=0.06)


def test_what_a_camera_looked_through_is_open_and_not_missing(without_wall: torch.Tensor) -> None:
    inside, outwards = camera([-0.3, 0, 0], [0.5, 0, 0]), camera([0.4, 0, 0], [-0.5, 0, 0])
    assert float(escaped(without_wall, inside, outwards).shares.sum()) < 0.01  # measured 0


def test_what_something_hides_from_a_camera_is_not_seen_through(without_wall: torch.Tensor) -> None:
    # Behind the far wall, looking at the opening through that wall.
    behind = camera([1.0, 0, 0], [-0.5, 0, 0], 60.0)
    assert float(escaped(without_wall, behind).shares.sum()) > 0.15  # measured 0.195


def test_nothing_is_missing_around_an_object() -> None:
    floor = closed_box(0.1).normals[:, 2] > 0.9
    assert float(escaped(floor, camera([0, 0, 1.0], [0, 0.01, -0.5])).shares.sum()) == 0.0


def test_without_cameras_nothing_is_known_to_be_missing(without_wall: torch.Tensor) -> None:
    assert not len(escaped(without_wall).shares)
