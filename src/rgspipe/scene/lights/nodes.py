"""Lights with an extent as points that shine together: a quadrature over what of them shines."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import torch
from torch import Tensor

from rgspipe.scene.lights.led import LedLight
from rgspipe.scene.lights.light import Light
from rgspipe.scene.lights.point import PointLight
from rgspipe.scene.lights.surface import Surface
from rgspipe.scene.shapes import Float


@dataclass(frozen=True)
class FacetLight(LedLight):
    """A small piece of a surface that shines to one side, and may lie on another surface."""

    @property
    def flush(self) -> bool:
        return True


@dataclass(frozen=True)
class ParallelLight(PointLight):
    """A point infinitely far away: its position is the unit vector towards it, its intensity an irradiance."""

    distant = True

    @property
    def place(self) -> Float[Tensor, " 4"]:
        return torch.cat([self.position, self.position.new_zeros(1)])


@dataclass(frozen=True)
class Nodes:
    """The points that a light with an extent is made of; each has the same part of its intensity.

    Attributes:
        positions: (Q, 3) scene units; of points at infinity unit vectors towards them.
        direction: (3,) along which each shines with the cosine, as a piece of a surface does; None where each shines
            alike in all directions.
        distant: whether they are infinitely far away.
        surface: that which they stand for: a sphere of points without a direction, a rectangle of those with one; None
            where it has another shape.
    """

    positions: Float[Tensor, "Q 3"]
    direction: Float[Tensor, " 3"] | None = None
    distant: bool = False
    surface: Surface | None = None

    def lights(self, intensity: Float[Tensor, " 3"]) -> tuple[Light, ...]:
        """A light at each, of a light of `intensity`."""
        part = intensity / len(self.positions)
        if self.direction is None:
            kind = ParallelLight if self.distant else PointLight
            return tuple(kind(position, part) for position in self.positions)
        return tuple(FacetLight(position, part, self.direction, 1.0) for position in self.positions)


@cache
def ball_nodes(few: bool = False) -> Tensor:
    """(12, 3) float64 points that shine as a uniform sphere of radius 1 does: the corners of an icosahedron; if `few`,
    (6, 3) those of an octahedron, with the same second moments.

    Seen from afar such a sphere is a disc of even brightness, and so is a cloud of points with the density
    1/√(1 − R²) within the ball (Abel). The field of a spherical cloud is that of a point in its middle (Newton's shell
    theorem, as irradiance falls with the square of the distance), so only occluders and horizons tell the two apart.
    The icosahedron of radius √¾ has the cloud's second moments, and integrates polynomials up to the fifth degree.
    """
    if few:
        return math.sqrt(0.75) * torch.cat([torch.eye(3), -torch.eye(3)]).double()
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    corners = [(0.0, one, other * golden) for one in (-1.0, 1.0) for other in (-1.0, 1.0)]
    turned = [torch.tensor(corners, dtype=torch.float64).roll(shift, dims=1) for shift in range(3)]
    return math.sqrt(0.75) * torch.nn.functional.normalize(torch.cat(turned), dim=1)


@cache
def square_nodes(side: int, few: bool = False) -> Tensor:
    """(side², 2) float64 middles of the pieces of a square of side 1 around 0; if `few`, (4, 2) those of Gauss and
    Legendre, with the square's second moments."""
    middles = (torch.arange(side, dtype=torch.float64) + 0.5) / side - 0.5
    if few:
        middles = torch.tensor([-0.5, 0.5], dtype=torch.float64) / math.sqrt(3.0)
    return torch.cartesian_prod(middles, middles)
