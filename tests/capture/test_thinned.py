"""Large photographs of which a part of the pixels is looked at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from photographed_room import painted_room, pictures, radiance_under
from rgspipe.capture.radiance import measured_radiance
from rgspipe.capture.thinned import PIXELS, thinned, thinning
from rgspipe.scene import PointLight
from rgspipe.training.materials import trace_views


@pytest.mark.parametrize("step", [1, 2, 3, 7])
def test_pixels_that_are_left_look_where_they_looked(step: int) -> None:
    (view,) = pictures(torch.ones(len(painted_room()), 3), 1, 40)
    view = replace(view, camera=replace(view.camera, cx=17.3), depth=torch.arange(1600.0).reshape(40, 40))
    left = thinned(view, step)
    rows, columns = (torch.arange((step - 1) // 2, 40, step) for _ in range(2))
    kept = (rows[:, None] * 40 + columns).reshape(-1)
    assert left.depth.shape == left.image.shape[:2] == (left.camera.height, left.camera.width)
    assert torch.equal(left.depth.reshape(-1), view.depth.reshape(-1)[kept])
    for one, other in zip(left.camera.rays(), view.camera.rays(kept), strict=True):
        torch.testing.assert_close(one, other, rtol=1e-9, atol=1e-9)


def test_no_pixel_is_left_out_where_surfels_are_many() -> None:
    views = pictures(torch.ones(len(painted_room()), 3), 10, 40)
    assert thinning(views, 16_000 // PIXELS) == 1
    assert thinning(views, 4_000 // PIXELS) == 2


def test_the_radiance_is_that_of_all_pixels() -> None:
    surfels = painted_room()
    views = pictures(radiance_under((PointLight([0.1, -0.25, 0.3], [1.0, 0.8, 0.6]),)), 4, 160)
    measured = []
    for step, rays in ((1, 4), (3, 1)):
        taken = [thinned(view, step) for view in views]
        measured.append(measured_radiance(trace_views(surfels, taken, rays), taken))
    every, part = measured
    both = (part.seen > 3.0) & (every.seen > 27.0)
    off = np.abs(np.log(part.radiance[both] / every.radiance[both]))
    # Measured 0.00024 and 0.0014, by a ninth of the pixels.
    assert np.median(off) < 0.001 and np.quantile(off, 0.9) < 0.005
