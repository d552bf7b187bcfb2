"""Lamps that are known to hang on a surface of the scene: how a fit moves what is left open of their place."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from rgspipe.scene import Light
from rgspipe.scene.lights.coordinates import KNOWN, BeforePlane, Coordinate, OnPlane
from rgspipe.scene.walls import Wall

#: Lamps hang between these parts of the scene's size from their surface, where nobody says how far: nearer ones stand
#: on it (`CertaintyOptions.on_surface`).
NEAREST, FARTHEST = 0.002, 0.15


@dataclass(frozen=True, eq=False)
class Mount:
    """The surface that a light hangs on.

    Attributes:
        wall: it, at the foot of the place where the light was looked for.
        distance: how far the light hangs before it, scene units; None where that is found.
    """

    wall: Wall
    distance: float | None = None

    def hung(self, light: Light, place: Tensor, size: float) -> Light:
        """A light over the foot of the wall, as far from it as is known, or as `place` (3,) is."""
        height = self.distance
        if height is None:
            height = min(max(self.before(place), NEAREST * size), FARTHEST * size)
        return light.at(self.wall.place + height * self.wall.normal, self.wall.normal if light.faces_away else None)

    def before(self, place: Tensor) -> float:
        """How far a place (3,) is before the wall, scene units."""
        return float((place - self.wall.place) @ self.wall.normal)

    def coordinates(self, light: Light) -> dict[str, Coordinate]:
        """By field how a fit moves what the mount changes."""
        normal = self.wall.normal
        place = BeforePlane(self.wall.place, normal, NEAREST, FARTHEST) if self.distance is None else OnPlane(normal)
        return {"position": place, **({"direction": KNOWN} if light.faces_away else {})}
