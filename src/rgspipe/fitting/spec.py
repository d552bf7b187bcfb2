"""What is known of the lights that a fit looks for."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.fitting.options import MOST_LIGHTS
from rgspipe.scene.lights import KINDS, Light

#: Each light may be a point or a spot: it is a spot where that is worth it.
AUTO = "auto"

#: The kinds among which "auto" chooses, the plainest first.
AUTO_KINDS = ("point", "spot")

TYPES = (*KINDS, AUTO)


@dataclass(frozen=True)
class LightSpec:
    """The lights that are looked for.

    Attributes:
        type: a kind of light by name, or "auto": each light may be a point or a spot.
        count: how many; None where it is not known (1 to MOST_LIGHTS).
        shape: a light of that kind ("auto": a spot), of which the shape is meant and not the place, such as
            `SpotLight.shaped("gaussian", 0.4, 0.1)`; the kind's usual one if None.
        shape_free: whether the numbers of the shape (cone angle, exponent …) are recovered, too; what `shape` says of
            them is then only where to begin.

    Raises:
        ValueError: an unknown type, a count out of range, or a shape of another kind.
    """

    type: str = "point"
    count: int | None = 1
    shape: Light | None = None
    shape_free: bool = False

    def __post_init__(self) -> None:
        if self.type not in TYPES:
            raise ValueError(f"type must be one of {TYPES}, got {self.type!r}")
        if self.count is not None and not 1 <= self.count <= MOST_LIGHTS:
            raise ValueError(f"count must be None or 1 to {MOST_LIGHTS}, got {self.count}")
        kind = shaped_kind(self.type)
        if self.shape is not None and self.shape.kind != kind:
            raise ValueError(f"the shape of lights of type {self.type!r} must be a {kind}, got {self.shape}")

    @property
    def kinds(self) -> tuple[Light, ...]:
        """A light of each kind that may be there, of the shape that it has; the plainest first."""
        names = AUTO_KINDS if self.type == AUTO else (self.type,)
        return (*(KINDS[name].shaped() for name in names[:-1]), self.shape or KINDS[names[-1]].shaped())

    @property
    def aimed(self) -> bool:
        """Whether lights with an axis may be among them."""
        return any(light.axis is not None for light in self.kinds)


def shaped_kind(type: str) -> str:
    """The kind whose shape is that of lights of a type."""
    return AUTO_KINDS[-1] if type == AUTO else type
