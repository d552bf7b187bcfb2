"""The cameras of a user's .blend file see what Blender says they see."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from rgspipe.datasets.named_cameras import read_camera


def test_points_are_where_blender_has_them(in_blender: Callable[..., None], tmp_path: Path) -> None:
    """For every way to state a lens, shifted, through cameras that are turned and scaled, of images of two shapes."""
    in_blender(tmp_path, "own_cameras")
    found = np.load(tmp_path / "pixels.npz")
    seen = [name for name in found.files if name != "points"]
    assert len(seen) == 6
    for name in seen:
        camera, width, height = name.split()
        pixels, _ = (
            read_camera(tmp_path / "cameras.json", camera)
            .of_image(int(width), int(height))
            .project(torch.from_numpy(found["points"]))
        )
        # Blender holds poses in float32.
        np.testing.assert_allclose(pixels, found[name], atol=1e-4)
    assert "cannot be a target's: flat" in (tmp_path / "remarks.txt").read_text()
