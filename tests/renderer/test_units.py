"""A scene looks the same in whatever unit its lengths are."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import room_cameras, room_surfels
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import NO_CLIP, Camera, Surfels


def _scaled(surfels: Surfels, factor: float) -> Surfels:
    coverage = replace(
        surfels.coverage,
        layer_thickness=factor * surfels.coverage.layer_thickness,
        clip_softness=factor * surfels.coverage.clip_softness,
    )
    assert (surfels.clip_offsets == NO_CLIP).all()
    return replace(surfels, centers=factor * surfels.centers, scales=factor * surfels.scales, coverage=coverage)


def _moved(camera: Camera, factor: float) -> Camera:
    pose = camera.camera_to_world.clone()
    pose[:3, 3] *= factor
    return replace(camera, camera_to_world=pose)


@pytest.mark.parametrize("factor", [2.0**-13, 2.0**17])
def test_surfels_without_edges_cover_the_same_pixels(factor: float) -> None:
    covered = [
        FrozenScene.freeze(_scaled(room_surfels(), unit), gather_rays=16, patches=50, seed=0)
        .view(_moved(room_cameras(12)[0], unit))
        .coverage
        for unit in (1.0, factor)
    ]
    torch.testing.assert_close(covered[1], covered[0], rtol=0, atol=1e-6)  # measured: 0
    assert covered[1].mean() > 0.99  # a factor of 1e5 left 0.76
