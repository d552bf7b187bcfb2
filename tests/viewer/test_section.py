"""A section shows what lies behind its plane as it is, and nothing of what is before it."""

from __future__ import annotations

import pytest
import torch

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, PointLight
from rgspipe.viewer.section import CutCamera

LAMP = PointLight([0.0, 0.0, 0.3], 0.5)


def test_a_closed_room_is_looked_into(frozen: FrozenScene) -> None:
    outside = Camera.look_at([0.0, -2.0, 0.0], [0.0, 0.0, 0.0], fov_degrees=30, width=24, height=24)
    inside = frozen.render(CutCamera.of(outside, 1, -0.3), LAMP)
    # From outside the wall is in the way, which no light reaches on that side: its back shows what is on its front.
    assert not torch.allclose(inside, frozen.render(outside, LAMP), rtol=0.1)
    # The opposite wall is what a camera in the room sees along the same rays.
    middle = frozen.render(CutCamera.of(outside, 1, -0.3), LAMP)[12, 12]
    near = Camera.look_at([0.0, -0.3, 0.0], [0.0, 0.5, 0.0], fov_degrees=4, width=1, height=1)
    torch.testing.assert_close(middle, frozen.render(near, LAMP)[0, 0], rtol=0.1, atol=0.0)


def test_without_anything_before_the_plane_nothing_changes(frozen: FrozenScene) -> None:
    camera = Camera.look_at([0.0, -0.45, 0.0], [0.1, 0.5, 0.0], fov_degrees=60, width=24, height=24)
    plain, cut = frozen.render(camera, LAMP), frozen.render(CutCamera.of(camera, 1, -0.4), LAMP)
    # Rays begin elsewhere, and float32 rounds otherwise: measured 8.2e-4, in a pixel on an edge.
    torch.testing.assert_close(cut, plain, rtol=0.0, atol=2e-3)


def test_rays_that_do_not_come_through_see_nothing(frozen: FrozenScene) -> None:
    camera = Camera.look_at([0.0, -0.2, 0.0], [0.0, 0.5, 0.0], fov_degrees=60, width=8, height=8)
    with pytest.warns(UserWarning, match="The camera sees nothing"):
        assert not frozen.render(CutCamera.of(camera, 1, -0.4), LAMP).any()


def test_sections_are_told_apart() -> None:
    camera = Camera.look_at([0.0, -2.0, 0.0], [0.0, 0.0, 0.0])
    keys = {camera.key, CutCamera.of(camera, 1, 0.1).key, CutCamera.of(camera, 1, 0.2).key}
    assert len({*keys, CutCamera.of(camera, 0, 0.1).key}) == 4


def test_parallel_rays_give_no_nan() -> None:
    camera = Camera.look_at([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], width=3, height=3)
    for place in (0.0, 0.5):
        origins, directions, _ = CutCamera.of(camera, 0, place).rays()
        assert origins.isfinite().all() and directions.isfinite().all()
