"""A plane that cuts away what is between the camera and it, to look into closed rooms. Light is not cut."""

from __future__ import annotations

from dataclasses import dataclass, fields

import torch
from torch import Tensor

from rgspipe.scene import Camera

#: Where rays begin that never come through the plane, in distances of the camera from it: beyond everything.
BEYOND = 1e6


@dataclass(frozen=True)
class CutCamera(Camera):
    """A camera whose rays begin on a plane across one of the axes.

    Attributes:
        axis: 0, 1 or 2, that the plane is across.
        place: of the plane on that axis, scene units.
    """

    axis: int
    place: float

    @classmethod
    def of(cls, camera: Camera, axis: int, place: float) -> CutCamera:
        """A camera with a plane before it, or behind it: what is on its own side of the plane is not seen."""
        return cls(**{item.name: getattr(camera, item.name) for item in fields(Camera)}, axis=axis, place=place)

    @property
    def key(self) -> bytes:
        return super().key + f"{self.axis} {self.place!r}".encode()

    def rays(
        self, pixels: Tensor | None = None, subsamples: int = 1, places: Tensor | None = None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """As a camera's, with origins on the plane; rays away from it begin where nothing is."""
        origins, directions, lengths = super().rays(pixels, subsamples, places)
        away = self.place - self.origin[self.axis]
        ahead = away / directions[:, self.axis]
        beyond = BEYOND * (1.0 + abs(float(away)))
        ahead = torch.where(torch.isfinite(ahead) & (ahead >= 0.0), ahead.clamp(max=beyond), beyond)
        return origins + ahead[:, None] * directions, directions, lengths
