"""A room of rectangles that is to be rendered: plain values that travel to Blender's process as JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import torch

from rgspipe.blender.job import RenderSettings
from rgspipe.scene import Camera, PointLight

#: Light that bounced never, or any number of times.
Kind = Literal["direct", "global"]


@dataclass(frozen=True)
class RoomFrame:
    """One image of a room.

    Attributes:
        name: path of the image below the room's folder, without suffix.
        kind: of light transport.
        camera: the camera, square pixels.
        light: the only light.
        seeds: of Cycles, one for each half of the samples.
    """

    name: str
    kind: Kind
    camera: Camera
    light: PointLight
    seeds: tuple[int, int]


@dataclass(frozen=True)
class RoomJob:
    """Every camera of a room × every light × direct and global light.

    Attributes:
        room: its name.
        corners: of each rectangle, counter-clockwise as seen from the front; Q × 4 × 3, scene units.
        albedo: of each rectangle, diffuse; Q × 3.
        poses: camera-to-world matrices, OpenGL axes; K × 4 × 4.
        field_of_view: across the width, rad.
        lights: positions; L × 3. Each is of 1 W/sr in every channel, and lights the room alone.
        resolution: width and height of the images, pixels.
        samples: per pixel of global images, half of them with a second seed; even.
        direct_samples: the same of direct images, which are noisy at edges only.
        max_bounces: of global images.
        seed: of the random draws.
    """

    room: str
    corners: list[list[list[float]]]
    albedo: list[list[float]]
    poses: list[list[list[float]]]
    field_of_view: float
    lights: list[list[float]]
    resolution: int
    samples: int
    direct_samples: int
    max_bounces: int
    seed: int

    def __post_init__(self) -> None:
        for name in ("samples", "direct_samples"):
            if getattr(self, name) < 2 or getattr(self, name) % 2:
                raise ValueError(f"{name} must be even and at least 2, got {getattr(self, name)}")

    @property
    def settings(self) -> dict[Kind, RenderSettings]:
        """Quality of half an image: every image is the mean of two with different seeds."""
        return {
            "direct": RenderSettings(self.resolution, self.direct_samples // 2, denoise=False, max_bounces=0),
            "global": RenderSettings(self.resolution, self.samples // 2, denoise=False, max_bounces=self.max_bounces),
        }

    def cameras(self) -> list[Camera]:
        """The K cameras."""
        poses = torch.tensor(self.poses, dtype=torch.float64)
        size = self.resolution
        return [Camera.from_field_of_view(pose, self.field_of_view, size, size) for pose in poses]

    def frames(self) -> list[RoomFrame]:
        """All images, in the order in which they are rendered."""
        positions = torch.tensor(self.lights, dtype=torch.float64)
        places = [(k, c, i, p) for k, c in enumerate(self.cameras()) for i, p in enumerate(positions)]
        first = 2 * len(places) * self.seed
        return [
            RoomFrame(
                image_name(kind, k, i), kind, camera, PointLight(position, torch.ones(3)),
                (first + 2 * number, first + 2 * number + 1),
            )
            for kind in self.settings
            for number, (k, camera, i, position) in enumerate(places)
        ]  # fmt: skip

    def to_json(self) -> dict:
        """Everything of the job, as JSON has it."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict) -> RoomJob:
        """The job that `to_json` described."""
        return cls(**content)


def image_name(kind: Kind, camera: int, light: int) -> str:
    """Path of an image below the room's folder, without suffix."""
    return f"{kind}/camera_{camera}_light_{light}"
