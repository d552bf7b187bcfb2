"""Photographs whose cameras look past the scene: of another scene, or with axes or poses of another kind."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

from rgspipe.scene import Camera
from rgspipe.scene.camera import AXES
from rgspipe.viewer.material import Photograph

#: How far beside a picture surfels' centres may be that reach into it, of its width and height.
BESIDE = 0.5


def astray(photographs: Sequence[Photograph], centers: Tensor) -> str:
    """Which of the photographs cannot show surfels at `centers` (N, 3), in a sentence; empty where each of them can."""
    names = [one.name for one in photographs if not _can_see(one.camera, centers)]
    return f"Nothing of the scene is before the camera of {', '.join(names)}. Check that {AXES}." if names else ""


def _can_see(camera: Camera, centers: Tensor) -> bool:
    places, depth = camera.project(centers.cpu())
    size = places.new_tensor([camera.width, camera.height])
    within = ((places > -BESIDE * size) & (places < (1.0 + BESIDE) * size)).all(dim=-1)
    return bool((within & (depth > 0.0)).any())
