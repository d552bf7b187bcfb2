"""Cycles as it is set up here measures what the equations say; and free space is where it should be."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from rgspipe.datasets.exr import read_channels, read_image
from rgspipe.scene import Camera, look_at

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def measured(in_blender: Callable[..., None], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What in_blender.py leaves of its plane and of free space."""
    folder = tmp_path_factory.mktemp("measured")
    in_blender(folder, "plane", "free_space")
    return folder


def _plane_view(height: float) -> tuple[Camera, np.ndarray]:
    """The camera of in_blender.py's plane, and the points of the plane behind its subpixels."""
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.5, -1.0, height]), torch.zeros(3)), 1.0, 16, 16)
    origins, directions, _ = camera.rays(subsamples=8)
    distance = -origins[:, 2] / directions[:, 2]
    return camera, (origins + distance[:, None] * directions).numpy()


def _expected(points: np.ndarray, height: float) -> np.ndarray:
    """L = ρ/π · I · cosθ/r², averaged over each pixel's 8 × 8 subpixels."""
    to_light = np.array([0.1, -0.2, height]) - points
    distance = np.linalg.norm(to_light, axis=1)
    irradiance = np.array([0.5, 1.0, 2.0]) * (abs(to_light[:, 2]) / distance**3)[:, None]
    return (np.array([0.2, 0.5, 0.8]) / math.pi * irradiance).reshape(16, 16, 64, 3).mean(axis=2)


def test_cycles_measures_radiance_depth_and_normals(measured: Path) -> None:
    for name, side in (("above", 1.0), ("below", -1.0)):
        _, points = _plane_view(1.5 * side)
        image, alpha = read_image(measured / f"{name}.exr")
        expected = _expected(points, 0.9 * side)
        # 2048 samples inside a pixel against 64 subpixels: measured 2.9e-4 at worst, 1.3e-5 for the mean.
        np.testing.assert_allclose(image, expected, rtol=1e-3)
        assert abs(image.mean() / expected.mean() - 1) < 1e-4
        assert (alpha == 1).all()
        normal = np.stack([read_channels(measured / f"{name}_normal.exr")[axis] for axis in "XYZ"], axis=-1)
        np.testing.assert_array_equal(normal, np.broadcast_to([0, 0, side], (16, 16, 3)))
        albedo = np.stack([read_channels(measured / f"{name}_albedo.exr")[channel] for channel in "RGB"], axis=-1)
        np.testing.assert_allclose(
            albedo, np.broadcast_to([0.2, 0.5, 0.8], (16, 16, 3)), rtol=5e-4
        )  # measured 2.4e-4: half


def test_depth_is_planar_at_pixel_centres(measured: Path) -> None:
    camera, _ = _plane_view(1.5)
    origins, directions, lengths = camera.rays()
    expected = (-origins[:, 2] / directions[:, 2] / lengths).reshape(16, 16).numpy()
    # The filter is 0.01 pixel wide: measured 3.4e-7.
    np.testing.assert_allclose(read_channels(measured / "above_depth.exr")["Z"], expected, rtol=1e-5)
    for suffix in ("", "_depth", "_normal", "_albedo"):
        first, again = ((measured / f"{name}{suffix}.exr").read_bytes() for name in ("above", "again"))
        assert first == again, "the same frame, rendered again after another one, must be the same file"


def test_solids_are_not_free_and_closed_rooms_are(measured: Path) -> None:
    found = np.load(measured / "free.npz")
    assert found["cornell"].tolist() == [True, False, True, True]
    assert found["closed"].tolist() == [True, False]
    assert found["is_room"]
