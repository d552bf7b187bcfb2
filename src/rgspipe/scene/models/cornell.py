"""The parametric Cornell box."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.arguments import as_number, as_several
from rgspipe.scene.models.box import Box, Vector, check_albedo, check_lengths
from rgspipe.scene.rectangles import Rectangles, rectangle

#: The walls, in the order of `CornellBox.walls`.
WALLS = ("floor", "ceiling", "back", "left", "right")


@dataclass(frozen=True)
class CornellBox:
    """A room around the origin, open towards −y, with boxes in it.

    Attributes:
        room: width (x), depth (y) and height (z).
        white: albedo of floor, ceiling and back wall (+y).
        left, right: albedo of the walls at −x and +x.
        boxes: what stands in the room.
        gloss: specular reflectance k_s of the boxes; 0 leaves them diffuse.
        shininess: exponent n of their Phong lobe.

    Raises:
        InputError: a length is not above 0, or a reflectance not from 0 to 1.
    """

    room: Vector = (1.0, 1.0, 1.0)
    white: Vector = (0.73, 0.73, 0.73)
    left: Vector = (0.65, 0.05, 0.05)
    right: Vector = (0.12, 0.45, 0.15)
    boxes: tuple[Box, ...] = (
        Box(center=(-0.17, 0.12, -0.2), size=(0.28, 0.28, 0.6), turn=0.3),
        Box(center=(0.18, -0.15, -0.35), size=(0.28, 0.28, 0.3), turn=-0.3),
    )
    gloss: float = 0.0
    shininess: float = 20.0

    def __post_init__(self) -> None:
        check_lengths("room", self.room)
        for name in ("white", "left", "right"):
            check_albedo(name, getattr(self, name))
        boxes = as_several(self.boxes, Box, "boxes", "Pass a tuple of them, empty for none.")
        object.__setattr__(self, "boxes", tuple(boxes))
        as_number(self.gloss, "gloss", expected="a reflectance from 0 to 1", low=0.0, high=1.0)
        as_number(self.shininess, "shininess", expected="an exponent, 1 or more", low=1.0)

    def walls(self) -> Rectangles:
        """The five walls, which face into the room."""
        width, depth, height = self.room
        a, b, c = 0.5 * width, 0.5 * depth, 0.5 * height
        along, back, up = [width, 0.0, 0.0], [0.0, depth, 0.0], [0.0, 0.0, height]
        return (
            rectangle([-a, -b, -c], along, back, self.white)
            + rectangle([-a, -b, c], back, along, self.white)
            + rectangle([-a, b, -c], along, up, self.white)
            + rectangle([-a, -b, -c], back, up, self.left)
            + rectangle([a, -b, -c], up, back, self.right)
        )

    def rectangles(self) -> Rectangles:
        """The walls, then the faces of the boxes."""
        return sum((box.rectangles() for box in self.boxes), self.walls())
