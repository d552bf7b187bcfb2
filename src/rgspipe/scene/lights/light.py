"""What every kind of light answers to: a fit, a file or a drawing asks the light, and never its kind."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import torch
from torch import Tensor

from rgspipe.arguments import as_number
from rgspipe.scene.arrays import ArrayLike, as_tensor
from rgspipe.scene.by_value import ByValue
from rgspipe.scene.lights.coordinates import PLACE, Coordinate
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.lights.shape_number import ShapeNumber
from rgspipe.scene.shapes import Float, Given

if TYPE_CHECKING:
    from rgspipe.scene.lights.nodes import Nodes
    from rgspipe.scene.lights.photometry import Photometry

#: What tables call the components of an axis.
AXIS_COLUMNS = ("ax", "ay", "az")

#: What an intensity is given as.
COLOUR = "Pass one number, which is grey, or three: red, green and blue."

#: Power [W] of a light that shines alike in all directions over its radiant intensity [W/sr].
WATTS_PER_INTENSITY = 4.0 * math.pi


@dataclass(frozen=True)
class RelativeIntensity:
    """What goes towards N points over a light's intensity (along its axis, if it has one), and its derivatives.

    Attributes:
        value: (N,) float32.
        by: derivatives towards the light's own fields by name: (N, 3) towards its position [per scene unit] and its
            direction (across it only), (N,) towards numbers of its shape, in their own units.
    """

    value: Float[Tensor, " N"]
    by: Mapping[str, Tensor]


@dataclass(frozen=True)
class Light(ByValue, ABC):
    """A source of light. Lists and numpy arrays are taken for its tensors; lights of the same numbers are equal.

    Attributes:
        position: (3,) scene units.
        intensity: (3,) RGB radiant intensity, W/sr, of a light with an axis along it; a single number is grey.

    Raises:
        InputError: what is given is no vector, no finite number, or one that such a light cannot have.
    """

    #: Its name in light files and settings.
    kind: ClassVar[str]

    #: Whether it is infinitely far away: its position says nothing, and its light does not fall with the distance.
    distant: ClassVar[bool] = False

    #: Whether a table of intensities makes its shape, as that of a measured luminaire.
    tabulated: ClassVar[bool] = False

    #: Of its intensity.
    unit: ClassVar[str] = "W/sr"

    #: What its numbers may be, in words and from where to where; any finite number where nothing is said.
    ranges: ClassVar[Mapping[str, tuple[str, float, float]]] = {}

    position: Given
    intensity: Given

    def __post_init__(self) -> None:
        for field in fields(self):
            if field.name in ("position", "direction"):
                object.__setattr__(self, field.name, as_tensor(getattr(self, field.name), field.name, (3,)))
            elif field.type == "float":
                value = getattr(self, field.name)
                expected, low, high = self.ranges.get(field.name, ("a finite number", -math.inf, math.inf))
                number = value.detach() if isinstance(value, Tensor) else value
                as_number(number, field.name, expected=expected, low=low, high=high)
        object.__setattr__(self, "intensity", _colour(self.intensity))

    @property
    def axis(self) -> Float[Tensor, " 3"] | None:
        """(3,) of unit length, along which it shines; None if it shines alike in all directions."""
        return None

    @property
    def place(self) -> Float[Tensor, " 4"]:
        """(4,) its position in homogeneous coordinates; see `renderer.kernels.places`."""
        return torch.cat([self.position, self.position.new_ones(1)])

    def standing(self, size: float) -> Float[Tensor, " 3"]:
        """(3,) where it stands in a scene of `size`, such that distances over the size tell lights apart."""
        return self.position

    def standing_spread(self, covariance: Any, size: float) -> Any:
        """(3, 3) covariance of `standing`, of the rows and columns of `FitResult.covariance`."""
        return covariance[:3, :3]

    @property
    def label(self) -> str:
        """What people call it."""
        return self.kind

    @property
    def in_one_point(self) -> bool:
        """Whether it stands at its position, and not at points that it is made of."""
        return self.parts()[0] is self

    @property
    def shape(self) -> tuple[ShapeNumber, ...]:
        """The numbers of its shape."""
        return ()

    @property
    def rim(self) -> float:
        """Standard deviation [rad] of its edge of light; infinite if it has none, 0 for a hard one."""
        return math.inf

    @property
    def flush(self) -> bool:
        """Whether it is a surface that may lie on another, which casts no shadow on what it lights."""
        return False

    @property
    def faces_away(self) -> bool:
        """Whether one that hangs on a surface shines straight away from it, rather than being aimed."""
        return False

    @property
    def plain(self) -> Light:
        """The simpler light at its place that a fit tries instead; itself if there is none."""
        return self

    @property
    def seed(self) -> Light:
        """The light in one point that a search looks for in its stead; itself if it has no extent."""
        return self

    @property
    def told(self) -> Self:
        """The same light by the numbers that results tell, where several sets of them mean the same."""
        return self

    def like(self, other: Light) -> Self:
        """The same light by the numbers that are nearest to those of another of its kind."""
        return self

    def same_sort(self, other: Light) -> bool:
        """Whether one becomes the other by moving: lights of other kinds, and other measured luminaires, do not."""
        return self.kind == other.kind

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes | None:
        """The points that it is made of; None if it stands in one.

        Args:
            values: its position, its direction if it has an axis, and the numbers of its shape, as tensors; what comes
                back is differentiable towards them.
            few: as few as have its middle and its second moments, for a search, which renders it often.
        """
        return None

    def parts(self, few: bool = False) -> tuple[Light, ...]:
        """Lights in one point each that shine together as it does, differentiable towards its tensors."""
        nodes = self.nodes(self.places(), few)
        return (self,) if nodes is None else nodes.lights(self.intensity)

    def places(self) -> dict[str, Tensor]:
        """What `nodes` is asked with: its fields but for the intensity, of the dtype of its position."""
        names = ["position", *(["direction"] if self.axis is not None else []), *(one.name for one in self.shape)]
        values = {name: getattr(self, name) for name in names if not isinstance(getattr(self, name), str)}
        to = {"dtype": self.position.dtype, "device": self.position.device}
        return {name: torch.as_tensor(value, **to) for name, value in values.items()}

    def grown(self, size: float, free: bool) -> tuple[Self, ...]:
        """Lights of this kind at its place that a fit begins with, in a scene of `size`, its shape known or `free`."""
        return (self,)

    def in_place_of(self, found: Light) -> Self:
        """The light where one like its `seed` was found."""
        return self.at(found.position, found.axis)

    @abstractmethod
    def power(self) -> Float[Tensor, " 3"]:
        """(3,) radiant power [W]: the intensity integrated over all directions."""

    def relative_intensity(
        self, points: Float[Tensor, "N 3"], *, softness: float = 0.0, shape_free: bool = False
    ) -> RelativeIntensity | None:
        """What of its intensity goes towards `points` (N, 3); None if all of it does.

        Args:
            softness: widens the edge of light by so much [rad]: a narrow one says where it is only to lights that
                almost hit the right place.
            shape_free: whether derivatives towards its shape are wanted, which take half of the time.
        """
        return None

    @property
    def least_relative_intensity(self) -> float:
        """The smallest relative intensity in any direction."""
        return 1.0

    def coordinates(self, shape_free: bool = False) -> dict[str, Coordinate]:
        """By field how a fit moves it; fields that are not named are known."""
        free = {number.name: number.coordinate for number in self.shape if shape_free and number.coordinate is not None}
        return {"position": PLACE, **free}

    def changed(self, name: str, value: Any) -> Self:
        """The light with another value of one field, and of those that are tied to it."""
        return replace(self, **{name: value})

    def tied_slopes(self, by: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """`RelativeIntensity.by` for moves by `changed`: through fields that are tied to another as well."""
        return by

    @classmethod
    @abstractmethod
    def shaped(cls, *numbers: Any) -> Self:
        """A light of 1 W/sr at the origin, along −z, of a shape: what is known of lights whose places are not."""

    def at(self, position: Tensor, direction: Tensor | None = None, intensity: Tensor | None = None) -> Self:
        """The light at another place, with its axis along `direction` (3,) of unit length, if it has one."""
        moved = replace(self, position=position, intensity=self.intensity if intensity is None else intensity)
        return moved if direction is None or self.axis is None else replace(moved, direction=direction)

    def variants(self) -> tuple[Self, ...]:
        """Lights of this kind whose shapes differ enough for a search to try each."""
        return (self,)

    def with_tables(self, table: Photometry, *others: Photometry) -> Self:
        """The light, if it is `tabulated`, of a measured luminaire, or of one of several."""
        raise TypeError(f"no table makes the shape of a {self.kind}")

    def to(self, *args: torch.dtype | torch.device | str) -> Self:
        """A copy with every tensor moved by `Tensor.to`."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **{name: value.to(*args) for name, value in values.items() if isinstance(value, Tensor)})

    def detached(self) -> Self:
        """A copy without gradients, in float64 on the CPU."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        tensors = {name: value.detach().double().cpu() for name, value in values.items() if isinstance(value, Tensor)}
        return replace(self, **tensors)

    def columns(self) -> dict[str, float]:
        """Its numbers by name, for tables: x … b, of one with an axis ax, ay, az, and those of its shape."""
        named = dict(zip("xyzrgb", [*self.position.tolist(), *self.intensity.tolist()], strict=True))
        if self.axis is not None:
            named |= dict(zip(AXIS_COLUMNS, self.axis.tolist(), strict=True))
        return named | {number.name: float(getattr(self, number.name)) for number in self.shape}

    def with_columns(self, values: Mapping[str, float]) -> Self | None:
        """The light of this kind whose `columns` were `values`; None where one is missing or not finite."""
        wanted = {name: values.get(name, math.nan) for name in self.columns()}
        if not all(map(math.isfinite, wanted.values())):
            return None
        vectors = {"position": "xyz", "intensity": "rgb"} | ({} if self.axis is None else {"direction": AXIS_COLUMNS})
        fields = {
            name: torch.tensor([wanted[key] for key in keys], dtype=torch.float64) for name, keys in vectors.items()
        }
        return replace(self, **fields, **{number.name: wanted[number.name] for number in self.shape})

    def file_fields(self) -> dict[str, object]:
        """What a light file says of it beside kind, position and intensity."""
        direction = {} if self.axis is None else {"direction": self.axis.double().tolist()}
        return direction | {number.key: float(getattr(self, number.name)) for number in self.shape}

    @classmethod
    @abstractmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        """The light that a file describes."""

    def emission(self, maths: Any, cosine: Any) -> Any:
        """Relative intensity as an expression of the angle's cosine, for other programs; None if it is 1.

        Args:
            maths: makes expressions of expressions and numbers; see `rgspipe.blender.lamp`.
            cosine: an expression.
        """
        return None


def _colour(value: ArrayLike) -> Tensor:
    """(3,) RGB; one number stands for all three."""
    if np.ndim(value) == 0:
        return as_tensor(value, "intensity", (), remedy=COLOUR).expand(3)
    return as_tensor(value, "intensity", (3,), remedy=COLOUR)
