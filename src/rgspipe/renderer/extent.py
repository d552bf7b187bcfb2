"""Lights with an extent, seen as the points that they are made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor
from torch.autograd.functional import jacobian

from rgspipe.renderer.unit_light import Share, UnitLight
from rgspipe.scene.lights import Light


@dataclass(frozen=True)
class LightPart:
    """One of the points that a light is made of, as a `UnitLight` of D' numbers: its position and its axis, if any.

    Attributes:
        light: it, of the whole light's intensity.
        softness: by how much its edge of light is widened [rad].
        chain: (1 + D', 1 + D) from the columns of a unit light here to the part that it has in those of the whole.
        share: which of them it is.
    """

    ways: ClassVar[None] = None

    light: Light
    softness: float
    chain: Tensor
    share: Share

    @property
    def shape_free(self) -> bool:
        return False

    def slopes(self, by: Mapping[str, Tensor]) -> Tensor:
        return torch.cat([by[name] for name in _fields(self.light)], dim=1)


def added(
    light: UnitLight, columns: Callable[[UnitLight], tuple[Tensor, ...]], few: bool = False
) -> tuple[Tensor, ...]:
    """Columns (…, 1 + D) of a light from those of lights in one point, added up over the points that it is made of.

    Args:
        few: whether of few points, see `Light.nodes`.
    """
    parts = parts_of(light, few)
    if parts is None:
        return columns(light)
    seen = ([one @ part.chain.to(one) for one in columns(part)] for part in parts)
    return tuple(map(sum, zip(*seen, strict=True)))


def parts_of(light: UnitLight, few: bool = False) -> list[LightPart] | None:
    """The points that a light is made of, and how they move with its numbers; None of a light in one point."""
    lights = light.light.parts(few)
    if light.light.in_one_point:
        return None
    places, share = light.light.places(), 1.0 / len(lights)

    def numbers(*values: Tensor) -> Tensor:
        nodes = light.light.nodes(dict(zip(places, values, strict=True)), few)
        axes = [] if nodes.direction is None else [nodes.direction.expand_as(nodes.positions)]
        return torch.cat([nodes.positions, *axes], dim=1)

    # Backwards, as torch.func takes 3 s to be imported.
    by_field = dict(zip(places, jacobian(numbers, tuple(places.values())), strict=True))
    rows, count = len(lights), 3 * len(_fields(lights[0]))
    flat = {name: by.reshape(rows * count, *by.shape[2:]) for name, by in by_field.items()}
    moved = light.slopes(flat).reshape(rows, count, -1)
    chains = share * torch.cat([torch.zeros_like(moved[:, :1]), moved], dim=1)
    value = torch.zeros_like(chains[:, :, :1])
    value[:, 0] = share
    chains = torch.cat([value, chains], dim=2)
    pairs = enumerate(zip(lights, chains, strict=True))
    return [LightPart(one, light.softness, chain, Share(index, rows)) for index, (one, chain) in pairs]


def _fields(light: Light) -> tuple[str, ...]:
    return ("position",) if light.axis is None else ("position", "direction")
