"""Where photographs with depth show that a plane ends."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rgspipe.completion.depth_views import DepthViews, Strip
from rgspipe.scene import Camera

#: A table at z = 0 ends at x = EDGE; a floor lies 0.7 below it.
EDGE, FLOOR = 0.3137, -0.7

STRIP = Strip(np.array([0.3, 0.0, 0.0]), np.eye(3)[1], np.eye(3)[0], np.eye(3)[2], (-0.4, 0.4), 0.06)

NEAR = 0.005


def cameras(count: int, height: float = 1.1) -> list[Camera]:
    rng = np.random.default_rng(5)
    return [
        Camera.look_at(
            [*rng.uniform([-0.6, -1.2], [0.6, -0.7]), height], [0.3, 0.0, 0.0], fov_degrees=50.0, width=64, height=48
        )
        for _ in range(count)
    ]


def depth_of(camera: Camera) -> torch.Tensor:
    """(H, W) planar depth of the table and the floor."""
    origins, directions, lengths = camera.rays()
    table, floor = (-(origins[..., 2] - level) / directions[:, 2] for level in (0.0, FLOOR))
    along = torch.where((origins + table[:, None] * directions)[:, 0] < EDGE, table, floor)
    along = torch.where(along > 0.0, along, torch.inf)
    return (along / lengths.reshape(-1)).reshape(camera.height, camera.width)


def shown(views: list[Camera], change=lambda depth: depth) -> float | None:
    found = DepthViews.of(views, [change(depth_of(camera)) for camera in views]).edge_in(STRIP, NEAR)
    return None if found is None else found + 0.3


def test_an_edge_is_found_to_a_small_part_of_a_pixel() -> None:
    """Of 64 × 48 pixels, 3 cm wide where they look on the table; surfels would be as far apart."""
    assert shown(cameras(30)) == pytest.approx(EDGE, abs=3e-4)  # measured 6e-5 off


def test_it_is_off_to_neither_side() -> None:
    rng, errors = np.random.default_rng(11), []
    for _ in range(40):
        eyes = [[*rng.uniform([-0.6, -1.2], [0.6, -0.7]), 1.1] for _ in range(4)]
        errors.append(
            shown([Camera.look_at(eye, [0.3, 0.0, 0.0], fov_degrees=50.0, width=64, height=48) for eye in eyes]) - EDGE
        )
    # Measured: 0.1 standard errors of a mean from zero, and 0.3 mm of deviation.
    assert abs(np.mean(errors)) < 3.0 * np.std(errors) / np.sqrt(len(errors))
    assert np.std(errors) < 1e-3


def test_noise_of_depth_and_strays_leave_it_where_it_is() -> None:
    generator = torch.Generator().manual_seed(2)

    def noisy(depth: torch.Tensor) -> torch.Tensor:
        stray = torch.rand(depth.shape, generator=generator) < 0.02
        return torch.where(stray, depth + 0.3, depth + 0.002 * torch.randn(depth.shape, generator=generator))

    assert shown(cameras(30), noisy) == pytest.approx(EDGE, abs=1.5e-3)  # measured 2e-4 off


def test_what_tells_no_edge_is_no_edge() -> None:
    assert DepthViews.of([], []).edge_in(STRIP, NEAR) is None
    assert DepthViews.of(cameras(3), [None] * 3).edge_in(STRIP, NEAR) is None
    # Nobody knows the depth, the table goes on, it is nowhere, it is seen from below alone, or it has holes all over.
    assert shown(cameras(5), lambda depth: torch.full_like(depth, torch.nan)) is None
    assert DepthViews.of(cameras(5), [torch.full((48, 64), torch.inf)] * 5).edge_in(STRIP, NEAR) is None
    assert shown(cameras(5, height=-0.3)) is None
    generator = torch.Generator().manual_seed(4)

    def holed(depth: torch.Tensor) -> torch.Tensor:
        return torch.where(torch.rand(depth.shape, generator=generator) < 0.4, torch.inf, depth)

    assert shown(cameras(5), holed) is None


def test_what_stands_before_the_plane_tells_nothing() -> None:
    """A cup on the table hides a part of its edge from some."""

    def hidden(depth: torch.Tensor) -> torch.Tensor:
        before = depth.clone()
        before[20:26] = 0.4
        return before

    assert shown(cameras(30), hidden) == pytest.approx(EDGE, abs=5e-4)  # measured 6e-5 off
