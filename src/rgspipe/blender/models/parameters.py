"""What Blender renders: plain values that travel to its process as JSON."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.blender.options import HotdogParameters, RoomParameters, ZooParameters
from rgspipe.scene.models import Box, CornellBox, Corridor


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


Model = CornellBox | Corridor | HotdogParameters | RoomParameters | ZooParameters | BlendFile

#: The kinds of scenes that Blender renders.
KINDS: dict[str, type[Model]] = {
    "cornell": CornellBox,
    "corner": Corridor,
    "hotdog": HotdogParameters,
    "room": RoomParameters,
    "zoo": ZooParameters,
    "blend": BlendFile,
}


def kind_of(model: Model) -> str:
    """The name in KINDS."""
    return next(name for name, schema in KINDS.items() if isinstance(model, schema))


def model_from_json(kind: str, content: dict) -> Model:
    """The model of a kind whose fields JSON holds."""
    values = _tuples(content)
    if "boxes" in values:
        values["boxes"] = tuple(Box(**_tuples(box)) for box in values["boxes"])
    return KINDS[kind](**values)


def _tuples(content: dict) -> dict:
    """JSON knows no tuples."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in content.items()}
