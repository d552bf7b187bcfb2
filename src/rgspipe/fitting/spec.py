"""What is known of the lights that a fit looks for."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any, NoReturn, Self, get_args

import numpy as np

from rgspipe.errors import InputError
from rgspipe.fitting.options import MOST_LIGHTS
from rgspipe.names import LightType, Mount
from rgspipe.options import check_names
from rgspipe.scene.lights import KINDS, Light, Photometry, ProfileLight

#: Each light may be of any kind: of the plainest that explains it.
AUTO = "auto"

#: The kinds that "auto" searches, the plainest first, and the one whose shape can be said. What is found is then tried
#: as the kinds that only look like these from afar, too: see `selection.kinds`.
AUTO_KINDS, AUTO_SHAPED = ("point", "sun", "spot", "led"), "spot"

TYPES: tuple[LightType, ...] = get_args(LightType)

#: What lights may hang on, nothing first.
MOUNTS: tuple[Mount, ...] = get_args(Mount)


@dataclass(frozen=True)
class LightSpec:
    """The lights that are looked for.

    Attributes:
        type: a kind of light by name, or "auto": each light may be a point, a spot, an LED, a sphere or a panel, a sun
            if the scene has an opening, or one of `luminaires`, and is the plainest of them that explains it.
        count: how many; None where it is not known (1 to MOST_LIGHTS).
        shape: a light of that kind ("auto": a spot), of which the shape is meant and not the place, such as
            `SpotLight.shaped("gaussian", 0.4, 0.1)`; the kind's usual one if None.
        shape_free: whether the numbers of the shape (cone angle, exponent …) are recovered, too; what `shape` says of
            them is then only where to begin. With "auto" that is about spots; of other kinds they always are.
        mount: "surface": they hang on surfaces of the scene; "ceiling": on such as face down (−z). Panels and LEDs then
            shine straight away from them. "free": they may be anywhere.
        distance: how far they hang from their surface, scene units; where None, panels lie on it, and of others it is
            found.
        ambient: whether there may be light besides, from all around through openings; its radiance is recovered, too.
        luminaires: tables of measured luminaires that lights may have where the type is "auto"; those of "profile" are
            a part of its shape.

    Raises:
        InputError: an unknown field or type, a count out of range, a shape of another kind, or luminaires of one.
    """

    type: LightType = "point"
    count: int | None = 1
    shape: Light | None = None
    shape_free: bool = False
    mount: Mount = "free"
    distance: float | None = None
    ambient: bool = False
    luminaires: tuple[Photometry, ...] = ()

    def __new__(cls, *args: Any, **values: Any) -> Self:
        check_names(values, [item.name for item in fields(cls)], "LightSpec")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        if self.type not in TYPES:
            _refuse("type", f"one of {', '.join(TYPES)}", self.type, "Correct the name.")
        if self.count is not None and not (isinstance(self.count, Integral) and 1 <= self.count <= MOST_LIGHTS):
            _refuse("count", f"None or a whole number from 1 to {MOST_LIGHTS}", self.count, "None has them counted.")
        for name in ("shape_free", "ambient"):
            if not isinstance(getattr(self, name), bool | np.bool_):
                _refuse(name, "True or False", getattr(self, name), "Pass one of them.")
        kind = shaped_kind(self.type)
        if self.shape is not None and not (isinstance(self.shape, Light) and self.shape.kind == kind):
            _refuse("shape", f"a {kind}, as the type is {self.type}", self.shape, "Let type and shape agree.")
        if self.luminaires and self.type != AUTO:
            remedy = 'Put the tables of a "profile" into its shape.'
            _refuse("luminaires", f"none, as the type is {self.type}", f"{len(self.luminaires)} tables", remedy)
        if self.mount not in MOUNTS:
            _refuse("mount", f"one of {', '.join(MOUNTS)}", self.mount, "Correct the name.")
        if self.mounted and self.kinds[-1].distant:
            _refuse("mount", MOUNTS[0], self.mount, f"A {self.type} hangs on nothing.")
        if not all(isinstance(table, Photometry) for table in self.luminaires):
            _refuse("luminaires", "tables", self.luminaires, "rg.read_photometry reads one.")
        if self.distance is not None and (self.mount == MOUNTS[0] or not _is_distance(self.distance)):
            remedy = "Say what they hang on (mount), or leave the distance out."
            _refuse("distance", "None, or with a mount a number ≥ 0", self.distance, remedy)

    @property
    def kinds(self) -> tuple[Light, ...]:
        """A light of each kind that may be there, of the shape that it has; the plainest first."""
        names = self._auto_kinds if self.type == AUTO else (self.type,)
        known = {} if self.shape is None else {self.shape.kind: self.shape}
        return tuple(known.get(name) or KINDS[name].shaped() for name in names)

    @property
    def _auto_kinds(self) -> tuple[str, ...]:
        return tuple(name for name in AUTO_KINDS if not (self.mounted and KINDS[name].distant))

    @property
    def tables(self) -> tuple[ProfileLight, ...]:
        """A light of each measured luminaire that is to be told from others."""
        if self.luminaires:
            return ProfileLight.shaped().with_tables(*self.luminaires).variants()
        kind = self.kinds[-1]
        return kind.variants() if isinstance(kind, ProfileLight) and self.shape_free else ()

    def free(self, kind: Light) -> bool:
        """Whether the shape of lights of a kind is recovered."""
        return self.shape_free or (self.type == AUTO and kind.kind != AUTO_SHAPED)

    @property
    def mounted(self) -> bool:
        """Whether they are known to hang on something."""
        return self.mount != MOUNTS[0]

    def distance_of(self, kind: Light) -> float | None:
        """How far lights of a kind hang from their surface; None where that is found."""
        return 0.0 if self.distance is None and kind.flush else self.distance

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


def _is_distance(value: object) -> bool:
    return isinstance(value, Real) and 0.0 <= value < math.inf


def shaped_kind(type: str) -> str:
    """The kind whose shape is that of lights of a type."""
    return AUTO_SHAPED if type == AUTO else type
