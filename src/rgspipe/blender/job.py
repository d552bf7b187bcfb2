"""What is to be rendered: plain values that travel to Blender's process as JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Literal

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """A solid box that stands in the room.

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
    """A room around the origin, inside the unit cube, open towards −y, with boxes in it; +z is up.

    Attributes:
        room: width (x), depth (y) and height (z), scene units.
        white: albedo of floor, ceiling and back wall (+y).
        left, right: albedo of the walls at −x and +x.
        boxes: what stands in the room.
    """

    room: Vector = (1.0, 1.0, 1.0)
    white: Vector = (0.73, 0.73, 0.73)
    left: Vector = (0.65, 0.05, 0.05)
    right: Vector = (0.12, 0.45, 0.15)
    boxes: tuple[Box, ...] = (
        Box(center=(-0.17, 0.12, -0.2), size=(0.28, 0.28, 0.6), turn=0.3),
        Box(center=(0.18, -0.15, -0.35), size=(0.28, 0.28, 0.3), turn=-0.3),
    )


@dataclass(frozen=True)
class RenderSettings:
    """What decides the quality of an image.

    Attributes:
        resolution: width and height, pixels.
        samples: Cycles samples a pixel.
        denoise: whether Open Image Denoise runs over the result.
        max_bounces: bounces of light that Cycles follows; 0 is direct light alone.
    """

    resolution: int
    samples: int
    denoise: bool
    max_bounces: int


@dataclass(frozen=True)
class DatasetJob:
    """One dataset.

    Attributes:
        scene: name of the scene, written into dataset_info.json.
        kind: a Cornell box of our own, or the user's .blend file.
        blend_path: the file, for kind "blend".
        cornell: the room, for kind "cornell".
        train_views, test_views: images with one known light each.
        targets_per_class: fit targets of each class (visible, out of frame, occluded).
        target_views: cameras that see every target, 1 to 3.
        resolution: width and height of every image, pixels.
        samples: Cycles samples a pixel.
        denoise: whether Open Image Denoise runs over the result.
        max_bounces: bounces of light that Cycles follows.
        light_clearance: least distance of training, test and ordinary target lights from any surface.
        hidden_light_clearance: the same for targets of the class "occluded".
        seed: of every random draw; each frame draws from its own stream, so that frame k does not
            depend on how many there are.
    """

    scene: str = "cornell"
    kind: Literal["cornell", "blend"] = "cornell"
    blend_path: str | None = None
    cornell: CornellParameters = field(default_factory=CornellParameters)
    train_views: int = 100
    test_views: int = 24
    targets_per_class: int = 20
    target_views: int = 3
    resolution: int = 128
    samples: int = 96
    denoise: bool = True
    max_bounces: int = 12
    light_clearance: float = 0.08
    hidden_light_clearance: float = 0.05
    seed: int = 0

    def __post_init__(self) -> None:
        least = {"train_views": 0, "test_views": 0, "targets_per_class": 0, "resolution": 1, "samples": 1}
        for name, lowest in least.items():
            if getattr(self, name) < lowest:
                raise ValueError(f"{name} must be at least {lowest}, got {getattr(self, name)}")
        if not 1 <= self.target_views <= 3:
            raise ValueError(f"target_views must be 1, 2 or 3, got {self.target_views}")
        if self.kind == "blend" and not self.blend_path:
            raise ValueError('kind "blend" needs blend_path')

    @property
    def settings(self) -> RenderSettings:
        """The quality of its images."""
        return RenderSettings(self.resolution, self.samples, self.denoise, self.max_bounces)

    def to_json(self) -> dict:
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict) -> DatasetJob:
        """The job that `to_json` described."""
        room = dict(content["cornell"])
        boxes = tuple(
            Box(tuple(box["center"]), tuple(box["size"]), box["turn"], tuple(box["albedo"]))
            for box in room.pop("boxes")
        )
        walls = {name: tuple(albedo) for name, albedo in room.items()}
        return cls(**{**content, "cornell": CornellParameters(**walls, boxes=boxes)})
