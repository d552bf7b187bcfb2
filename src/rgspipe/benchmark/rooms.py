"""Rooms with exact geometry, cameras and lights, on which renderers are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.benchmark.names import RoomName
from rgspipe.scene import Camera, PointLight, look_at
from rgspipe.scene.models import CornellBox, FloorPlan
from rgspipe.scene.rectangles import Rectangles, inside_of_box, solid_box

WHITE, RED, GREEN = (0.73, 0.73, 0.73), (0.65, 0.05, 0.05), (0.12, 0.45, 0.15)
WOOD, BLUE, GREY = (0.55, 0.35, 0.2), (0.15, 0.25, 0.6), (0.5, 0.5, 0.5)


@dataclass(frozen=True)
class Room:
    """A room, what is seen of it and what lights it.

    Attributes:
        name: of its artifact and its rows.
        surfaces: what is in it; about the size of the unit cube.
        viewpoints: (K, 2, 3) where cameras stand and what they look at.
        lights: (L, 3) positions of the lights; each lights the room alone. The last two are near a surface.
        field_of_view: of the cameras, rad.
    """

    name: str
    surfaces: Rectangles
    viewpoints: Tensor
    lights: Tensor
    field_of_view: float = 0.9

    def cameras(self, resolution: int) -> list[Camera]:
        """The K cameras, square images."""
        return [
            Camera.from_field_of_view(look_at(eye, aim), self.field_of_view, resolution, resolution)
            for eye, aim in self.viewpoints.float()
        ]

    def rig(self, light: int) -> tuple[PointLight]:
        """Light number `light`, of intensity 1 W/sr."""
        return (PointLight(self.lights[light].float(), torch.ones(3)),)

    def clearance(self, light: int) -> float:
        """Distance of a light from the nearest surface, scene units."""
        s, offset = self.surfaces, self.lights[light].double() - self.surfaces.origins
        along = [(offset * side).sum(1) / side.square().sum(1) for side in (s.sides_a, s.sides_b)]
        a, b = (share.clamp(0.0, 1.0)[:, None] for share in along)
        return float((offset - a * s.sides_a - b * s.sides_b).norm(dim=1).min())


def _cornell() -> Room:
    """Open towards −y, with two boxes; the same room as the scene cornell."""
    viewpoints = [[[0.0, -1.6, 0.0], [0.0, 0.0, 0.0]], [[0.35, -1.2, 0.3], [0.0, 0.1, -0.15]]]
    lights = [[0.0, 0.0, 0.38], [-0.3, -0.3, 0.2], [0.3, 0.25, -0.1], [0.44, 0.1, 0.1], [-0.1, -0.2, -0.45]]
    return Room("cornell", CornellBox().rectangles(), torch.tensor(viewpoints), torch.tensor(lights))


def _corridor() -> Room:
    """A closed L-shaped corridor; one light stands in the leg that the camera does not see."""
    h, inner = 0.5, -0.1  # half the outer size, the corner inside; the corridor is 0.4 wide
    plan = FloorPlan(
        outline=((-h, -h), (h, -h), (h, inner), (inner, inner), (inner, h), (-h, h)),
        height=0.4,
        walls=(WHITE, WHITE, RED, WHITE, WHITE, BLUE),
        floor=WOOD,
        ceiling=WHITE,
    )
    viewpoints = [[[0.42, -0.3, 0.0], [-0.5, -0.28, -0.03]], [[0.1, -0.42, 0.12], [-0.4, 0.0, -0.1]]]
    lights = [[-0.3, 0.3, 0.05], [0.2, -0.3, 0.08], [-0.25, -0.15, -0.08], [-0.45, -0.2, 0.0], [0.3, -0.3, 0.16]]
    return Room("corridor", plan.rectangles(), torch.tensor(viewpoints), torch.tensor(lights), field_of_view=1.2)


def _clutter() -> Room:
    """A closed room with a table, shelves and boxes, many of them in each other's way."""
    room = inside_of_box([0.0, 0.0, 0.0], [1.0, 1.0, 0.8], GREY)
    room.albedo[:3] = torch.tensor([WOOD, WHITE, GREY], dtype=torch.float64)
    floor = -0.4
    table = solid_box([0.12, 0.1, floor + 0.27], [0.4, 0.3, 0.03], WOOD, 0.2)
    for x, y in ((-0.15, -0.1), (0.15, -0.1), (-0.15, 0.1), (0.15, 0.1)):
        table += solid_box([0.12 + x - 0.2 * y, 0.1 + y + 0.2 * x, floor + 0.128], [0.03, 0.03, 0.255], WOOD, 0.2)
    shelf = solid_box([-0.42, 0.1, floor + 0.3], [0.14, 0.5, 0.02], BLUE)
    shelf += solid_box([-0.42, 0.1, floor + 0.55], [0.14, 0.5, 0.02], BLUE)
    boxes = [
        ([-0.42, -0.02, floor + 0.37], [0.1, 0.1, 0.12], RED, 0.3),
        ([-0.42, 0.2, floor + 0.36], [0.09, 0.14, 0.1], WHITE, -0.2),
        ([0.1, 0.1, floor + 0.36], [0.12, 0.1, 0.15], GREEN, 0.7),
        ([0.24, 0.16, floor + 0.32], [0.08, 0.08, 0.07], RED, 0.1),
        ([-0.12, -0.18, floor + 0.08], [0.16, 0.16, 0.16], WHITE, 0.5),
        ([0.32, -0.25, floor + 0.15], [0.12, 0.12, 0.3], BLUE, -0.4),
        ([0.38, 0.4, floor + 0.3], [0.16, 0.12, 0.6], WHITE, 0.0),
    ]
    for center, size, albedo, turn in boxes:
        room += solid_box(center, size, albedo, turn)
    viewpoints = [[[-0.35, -0.42, 0.2], [0.15, 0.15, -0.15]], [[0.42, -0.44, 0.25], [-0.25, 0.15, -0.2]]]
    lights = [[-0.05, -0.1, 0.28], [0.3, -0.05, 0.1], [-0.2, 0.3, -0.1], [0.0, 0.45, 0.2], [0.2, 0.02, -0.06]]
    return Room("clutter", room + table + shelf, torch.tensor(viewpoints), torch.tensor(lights), field_of_view=1.2)


#: How each room is made.
ROOMS: dict[RoomName, Callable[[], Room]] = {"cornell": _cornell, "corridor": _corridor, "clutter": _clutter}
