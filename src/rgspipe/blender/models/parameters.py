"""The measures of the scenes that are modelled here: plain values that travel to Blender's process as JSON.

All scenes lie in the unit cube around the origin, +z up; lengths are in scene units, colours are diffuse
reflectance RGB.
"""

from __future__ import annotations

from dataclasses import dataclass

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """A solid box that stands in a room.

    Attributes:
        center: scene units.
        size: edge lengths, scene units.
        turn: rotation about +z, rad.
        albedo: diffuse reflectance RGB.
    """

    center: Vector
    size: Vector
    turn: float
    albedo: Vector = (0.73, 0.73, 0.73)


@dataclass(frozen=True)
class CornellParameters:
    """A room around the origin, open towards −y, with boxes in it.

    Attributes:
        room: width (x), depth (y) and height (z).
        white: albedo of floor, ceiling and back wall (+y).
        left, right: albedo of the walls at −x and +x.
        boxes: what stands in the room.
        gloss: specular reflectance k_s of the boxes; 0 leaves them diffuse.
        shininess: exponent n of their Phong lobe.
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

    @classmethod
    def from_plain(cls, content: dict) -> CornellParameters:
        """The parameters that JSON holds."""
        boxes = tuple(Box(**_tuples(box)) for box in content["boxes"])
        return cls(**_tuples(content) | {"boxes": boxes})


@dataclass(frozen=True)
class CornerParameters:
    """A closed corridor that turns: one leg along −x, one along +y, each 1 long outside.

    Attributes:
        width: of the corridor.
        height: of the corridor.
        wall: albedo of walls and ceiling.
        floor: albedo of the floor.
        near_end, far_end: albedo of the walls at the end of the leg with the target cameras, and of the other.
    """

    width: float = 0.32
    height: float = 0.45
    wall: Vector = (0.75, 0.75, 0.72)
    floor: Vector = (0.55, 0.5, 0.42)
    near_end: Vector = (0.2, 0.35, 0.65)
    far_end: Vector = (0.7, 0.4, 0.15)

    @classmethod
    def from_plain(cls, content: dict) -> CornerParameters:
        """The parameters that JSON holds."""
        return cls(**_tuples(content))


@dataclass(frozen=True)
class HotdogParameters:
    """A hot dog on a plate, in empty space.

    Attributes:
        textured: procedural textures on bun, sausage and plate; without them every part has one colour.
        segments: faces around a plate or a bun. Normals of smooth surfaces turn by half of 360°/segments in a face.
    """

    textured: bool = True
    segments: int = 192

    @classmethod
    def from_plain(cls, content: dict) -> HotdogParameters:
        """The parameters that JSON holds."""
        return cls(**content)


@dataclass(frozen=True)
class RoomParameters:
    """A closed, furnished room.

    Attributes:
        textured: procedural textures on floor, walls and furniture; without them every part has one colour.
        segments: faces around whatever is round.
    """

    textured: bool = True
    segments: int = 192

    @classmethod
    def from_plain(cls, content: dict) -> RoomParameters:
        """The parameters that JSON holds."""
        return cls(**content)


@dataclass(frozen=True)
class BlendFile:
    """The scene of a user's .blend file.

    Attributes:
        path: the file.
    """

    path: str

    def __post_init__(self) -> None:
        if not self.path:
            raise ValueError("a blend file needs a path")

    @classmethod
    def from_plain(cls, content: dict) -> BlendFile:
        """The parameters that JSON holds."""
        return cls(**content)


Model = CornellParameters | CornerParameters | HotdogParameters | RoomParameters | BlendFile

#: The kinds of scenes that Blender renders.
KINDS: dict[str, type[Model]] = {
    "cornell": CornellParameters,
    "corner": CornerParameters,
    "hotdog": HotdogParameters,
    "room": RoomParameters,
    "blend": BlendFile,
}


def kind_of(model: Model) -> str:
    """The name in KINDS."""
    return next(name for name, schema in KINDS.items() if isinstance(model, schema))


def _tuples(content: dict) -> dict:
    """JSON knows no tuples."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in content.items()}
