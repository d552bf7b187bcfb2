"""The Cornell box as rectangles: the exact geometry that the scene's images were rendered from."""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.scene.rectangles import Rectangles, rectangle, solid_box

Vector = Sequence[float]


def cornell_rectangles(
    room: Vector,
    white: Vector,
    left: Vector,
    right: Vector,
    boxes: Sequence[tuple[Vector, Vector, float, Vector]],
) -> Rectangles:
    """A room around the origin, open towards −y, with boxes in it.

    Args:
        room: width (x), depth (y) and height (z), scene units.
        white: albedo of floor, ceiling and back wall (+y).
        left, right: albedo of the walls at −x and +x.
        boxes: centre, size, turn about +z [rad] and albedo of each. The faces on which they stand are there too.
    """
    width, depth, height = room
    a, b, c = 0.5 * width, 0.5 * depth, 0.5 * height
    along, back, up = [width, 0.0, 0.0], [0.0, depth, 0.0], [0.0, 0.0, height]
    surfaces = (
        rectangle([-a, -b, -c], along, back, list(white))
        + rectangle([-a, -b, c], back, along, list(white))
        + rectangle([-a, b, -c], along, up, list(white))
        + rectangle([-a, -b, -c], back, up, list(left))
        + rectangle([a, -b, -c], up, back, list(right))
    )
    for center, size, turn, albedo in boxes:
        surfaces += solid_box(list(center), list(size), list(albedo), turn)
    return surfaces
