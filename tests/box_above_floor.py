"""A box above a floor in the open, frozen."""

from __future__ import annotations

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.rectangles import rectangle, solid_box, surfels_on


def box_above_floor() -> FrozenScene:
    """The floor reaches from −1 to 1 along x and y, at z = 0; 0.1 above its middle hangs the box, 0.4 wide and high."""
    floor = rectangle([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.5] * 3)
    return FrozenScene.freeze(
        surfels_on(floor + solid_box([0.0, 0.0, 0.3], [0.4] * 3, [0.6] * 3), 2500), gather_rays=64
    )
