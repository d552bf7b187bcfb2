"""What is known of the lights that a fit looks for."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, NoReturn, Self

from rgspipe.errors import InputError
from rgspipe.fitting.options import MOST_LIGHTS
from rgspipe.options import check_names
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
        mounted: whether they lie on surfaces of the scene, and shine away from them: panels alone.
        ambient: whether there may be light besides, from all around through openings; its radiance is recovered, too.

    Raises:
        InputError: an unknown field or type, a count out of range, or a shape of another kind.
    """

    type: str = "point"
    count: int | None = 1
    shape: Light | None = None
    shape_free: bool = False
    mounted: bool = False
    ambient: bool = False

    def __new__(cls, *args: Any, **values: Any) -> Self:
        check_names(values, [item.name for item in fields(cls)], "LightSpec")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        if self.type not in TYPES:
            _refuse("type", f"one of {', '.join(TYPES)}", self.type, "Correct the name.")
        if self.count is not None and not 1 <= self.count <= MOST_LIGHTS:
            _refuse("count", f"None or 1 to {MOST_LIGHTS}", self.count, "None has them counted.")
        kind = shaped_kind(self.type)
        if self.shape is not None and self.shape.kind != kind:
            _refuse("shape", f"a {kind}, as the type is {self.type}", self.shape, "Let type and shape agree.")

        if self.mounted and not self.kinds[-1].flush:
            _refuse("mounted", "False, but for panels", self.mounted, "Lights of other kinds stand free.")

    @property
    def kinds(self) -> tuple[Light, ...]:
        """A light of each kind that may be there, of the shape that it has; the plainest first."""
        names = AUTO_KINDS if self.type == AUTO else (self.type,)
        return (*(KINDS[name].shaped() for name in names[:-1]), self.shape or KINDS[names[-1]].shaped())

    @property
    def extended(self) -> bool:
        """Whether they have an extent."""
        return self.seed is not self

    @property
    def seed(self) -> LightSpec:
        """The lights in one point that a search looks for first; itself where these are they."""
        kind = self.kinds[-1]
        return self if kind.seed is kind else LightSpec(kind.seed.kind, self.count, kind.seed, ambient=self.ambient)

    @property
    def aimed(self) -> bool:
        """Whether lights with an axis may be among them."""
        return any(light.axis is not None for light in self.kinds)


def as_spec(lights: str | LightSpec) -> LightSpec:
    """What is known of the lights, of which a name may say all.

    Raises:
        InputError: something else, or an unknown name.
    """
    if isinstance(lights, str):
        return LightSpec(lights)
    if not isinstance(lights, LightSpec):
        remedy = 'LightSpec("point", count=2) are two point lights; a light whose shape is known goes into its shape.'
        raise InputError(
            "lights", expected="a kind of light by name, or a LightSpec", found=type(lights).__name__, remedy=remedy
        )
    return lights


def _refuse(field: str, expected: str, found: object, remedy: str) -> NoReturn:
    raise InputError(f"LightSpec.{field}", expected=expected, found=f"{found!r}", remedy=remedy)


def shaped_kind(type: str) -> str:
    """The kind whose shape is that of lights of a type."""
    return AUTO_KINDS[-1] if type == AUTO else type
