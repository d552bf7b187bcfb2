"""What an image model asks of a light: what it sends where, and what its image is differentiated towards."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Protocol

import torch
from torch import Tensor

from rgspipe.renderer.zonal_harmonics import BandLimit, band_limited_intensity
from rgspipe.scene.lights import Light, RelativeIntensity


class Share(NamedTuple):
    """The `index`-th of `count` points that shine together; a whole light if there is one."""

    index: int = 0
    count: int = 1


WHOLE = Share()


class UnitLight(Protocol):
    """A light of unit intensity, and the D numbers that its image is differentiated towards.

    The first of them move it; those of a light that shines alike in all directions are no others.
    """

    @property
    def light(self) -> Light:
        """It, in float64 on the CPU; its intensity is not looked at."""
        ...

    @property
    def softness(self) -> float:
        """By how much its edge of light is widened [rad]; see `Light.relative_intensity`."""
        ...

    @property
    def shape_free(self) -> bool:
        """Whether its shape is among the numbers."""
        ...

    @property
    def share(self) -> Share:
        """Which of the points of a light with an extent it is."""
        ...

    @property
    def ways(self) -> Tensor | None:
        """(3, d) float64 where the first d numbers move it; None where they are its position."""
        ...

    def slopes(self, by: Mapping[str, Tensor]) -> Tensor:
        """(N, D) derivatives towards the numbers, of what has these towards the light's fields."""
        ...


def emitted_intensity(light: UnitLight, points: Tensor, band: BandLimit | None) -> RelativeIntensity | None:
    """What a light sends towards `points` (N, 3) float64, exact or band-limited; None if all of it goes there.

    Args:
        band: None for the exact profile.
    """
    if band is None or light.light.axis is None:
        return light.light.relative_intensity(points, softness=light.softness, shape_free=light.shape_free)
    return band_limited_intensity(light.light, points, band, light.softness)


def attenuated(columns: Tensor, sent: RelativeIntensity | None, light: UnitLight) -> Tensor:
    """What a point light's `columns` (N, …, 4) are of `light`, which sends that much of its intensity there.

    Returns:
        (N, …, 1 + D): the value, then its derivatives.
    """
    if light.ways is not None:
        columns = torch.cat([columns[..., :1], columns[..., 1:] @ light.ways.to(columns)], dim=-1)
    if sent is None:
        return columns
    between = [1] * (columns.ndim - 2)
    value, slopes = sent.value.reshape(-1, *between, 1), light.slopes(sent.by)
    slopes = slopes.reshape(len(slopes), *between, slopes.shape[1])
    unit, moved = columns[..., :1], columns[..., 1:]
    products, ways = slopes * unit, moved.shape[-1]
    products = torch.cat([products[..., :ways] + value * moved, products[..., ways:]], dim=-1)
    return torch.cat([value * unit, products], dim=-1)


@dataclass(frozen=True)
class OwnLight:
    """A light as it is given, differentiated towards its own tensors: the position, and others that require gradients.

    Attributes:
        given: the light; its tensors may require gradients, be of any float type and on any device.
        softness: by how much its edge of light is widened [rad].
        share: which of the points of a light with an extent it is.
    """

    ways: ClassVar[None] = None

    given: Light
    softness: float = 0.0
    share: Share = WHOLE

    @cached_property
    def light(self) -> Light:
        """It, in float64 on the CPU."""
        return self.given.detached()

    @property
    def shape_free(self) -> bool:
        """Whether gradients towards a number of its shape are wanted."""
        return any(_wanted(getattr(self.given, number.name)) for number in self.given.shape)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The fields that are differentiated towards."""
        others = ["direction"] if self.given.axis is not None else []
        others += [number.name for number in self.given.shape]
        return ("position", *(name for name in others if _wanted(getattr(self.given, name))))

    def slopes(self, by: Mapping[str, Tensor]) -> Tensor:
        """(N, D) derivatives towards its tensors, one after the other."""
        slopes = [by[name] for name in self.names]
        return torch.cat([slope if slope.ndim > 1 else slope[:, None] for slope in slopes], dim=1)

    def attached(self, value: Tensor, slopes: Tensor) -> Tensor:
        """What of the light is `value` (N, …), as autograd knows how to differentiate it towards the light's tensors.

        What is added is zero, and its derivative is what is known: exact to first order. A second one is not there.

        Args:
            slopes: (N, …, D) its derivatives.
        """
        tensors = [getattr(self.given, name) for name in self.names]
        if not any(map(_wanted, tensors)):
            return value
        now = torch.cat([tensor.reshape(-1).double().cpu() for tensor in tensors])
        return value + slopes @ (now - now.detach()).to(slopes)


def _wanted(value: object) -> bool:
    return isinstance(value, Tensor) and value.requires_grad
