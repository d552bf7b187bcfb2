"""A closed room above any floor with right angles."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from rgspipe.scene.models.box import Vector
from rgspipe.scene.rectangles import Rectangles, rectangle


@dataclass(frozen=True)
class FloorPlan:
    """A closed room whose walls stand on an outline, half of its height above the origin and half below.

    Attributes:
        outline: x and y of the floor's corners, counter-clockwise, sides along x and y: the inside is to the left of
            each wall.
        height: of the room.
        walls: albedo of each wall, in the order of the corners at which they begin.
        floor, ceiling: their albedo.
    """

    outline: tuple[tuple[float, float], ...]
    height: float
    walls: tuple[Vector, ...]
    floor: Vector
    ceiling: Vector

    def wall_rectangles(self) -> Rectangles:
        """The walls, which face inwards, in their order."""
        up, bottom = [0.0, 0.0, self.height], -0.5 * self.height
        following = (*self.outline[1:], self.outline[0])
        first, *others = (
            rectangle([u, v, bottom], [x - u, y - v, 0.0], up, albedo)
            for (x, y), (u, v), albedo in zip(self.outline, following, self.walls, strict=True)
        )
        return sum(others, first)

    def floor_corners(self) -> list[Vector]:
        """Corners of the floor as one face, which looks up; it may have corners that point inwards."""
        return [(x, y, -0.5 * self.height) for x, y in self.outline]

    def ceiling_corners(self) -> list[Vector]:
        """The same of the ceiling, which looks down."""
        return [(x, y, 0.5 * self.height) for x, y in reversed(self.outline)]

    def rectangles(self) -> Rectangles:
        """The walls, then floor and ceiling, strip by strip from the least y."""
        surfaces, top = self.wall_rectangles(), 0.5 * self.height
        for low, high in pairwise(sorted({y for _, y in self.outline})):
            for start, end in self._inside(0.5 * (low + high)):
                along, across = [end - start, 0.0, 0.0], [0.0, high - low, 0.0]
                surfaces += rectangle([start, low, -top], along, across, self.floor)
                surfaces += rectangle([start, low, top], across, along, self.ceiling)
        return surfaces

    def _inside(self, y: float) -> list[tuple[float, float]]:
        """The least and the largest x of each stretch of the floor at `y`."""
        following = (*self.outline[1:], self.outline[0])
        walls = zip(self.outline, following, strict=True)
        crossed = sorted(x for (x, start), (_, end) in walls if min(start, end) < y < max(start, end))
        return list(zip(crossed[::2], crossed[1::2], strict=True))
