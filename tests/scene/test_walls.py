"""Walls are found in noisy surfels."""

from __future__ import annotations

from dataclasses import replace

import torch

from rgspipe.scene.walls import walls_near
from rooms import closed_box


def test_the_walls_of_a_corner_are_told_apart_and_their_noise_is_averaged() -> None:
    surfels, generator = closed_box(0.05), torch.Generator().manual_seed(0)
    noise = 0.01 * torch.randn(surfels.centers.shape, generator=generator, dtype=torch.float64)
    surfels = replace(surfels, centers=surfels.centers + noise)
    point = torch.tensor([0.1, 0.43, 0.4], dtype=torch.float64)
    back, ceiling = walls_near(surfels, point, 1.0, 2)
    expected = torch.tensor([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]], dtype=torch.float64)
    torch.testing.assert_close(torch.stack([back.normal, ceiling.normal]), expected)
    # Noise of 0.01 a surfel leaves 0.002 of the plane.
    assert abs(float(back.place[1]) - 0.5) < 0.006 and abs(float(ceiling.place[2]) - 0.5) < 0.006
    torch.testing.assert_close(back.place[[0, 2]], point[[0, 2]])
    assert len(walls_near(surfels, point, 1.0, 1)) == 1
