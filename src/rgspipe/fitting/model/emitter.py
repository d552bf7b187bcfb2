"""What a fit may move of one light: place, axis, shape. Intensities are not among it: they have a closed form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from typing import ClassVar

import torch
from torch import Tensor

from rgspipe.fitting.model.mount import Mount
from rgspipe.renderer.unit_light import WHOLE, Share
from rgspipe.scene.lights import Light
from rgspipe.scene.lights.coordinates import Coordinate

#: R, G and B.
COLOURS = 3


@dataclass(frozen=True)
class Emitter:
    """A light without its intensity, and how it moves.

    Its D parameters are those of the light's coordinates, one after the other: the position in units of the scene's
    size; of a light with an axis two coordinates of it, tangent to the sphere at the present axis [rad]; where the
    shape is free, what moves of that. They have about the same effect for the same number.

    Attributes:
        light: float64 on the CPU; its intensity is not looked at.
        shape_free: whether its shape moves.
        softness: by how much its edge of light is widened for now [rad]; see `Light.relative_intensity`.
        mount: the surface that it is known to hang on; None where it is free.
    """

    share: ClassVar[Share] = WHOLE

    light: Light
    shape_free: bool = False
    softness: float = 0.0
    mount: Mount | None = None

    @classmethod
    def of(cls, light: Light, shape_free: bool = False) -> Emitter:
        """The emitter of a light, with an axis of unit length."""
        light = light.detached()
        if light.axis is None:
            return cls(light, shape_free)
        return cls(light.at(light.position, torch.nn.functional.normalize(light.axis, dim=0)), shape_free)

    @classmethod
    def fitted(cls, light: Light, covariance: Tensor) -> Emitter:
        """The emitter of a recovered light, whose shape was free where its `FitResult.covariance` has rows for that."""
        return cls.of(light, shape_free=len(covariance) > len(cls.of(light).spread()) + COLOURS)

    def rows(self) -> dict[str, slice]:
        """By the light's fields, and "intensity", their rows of `FitResult.covariance`."""
        counts = {name: len(one.spread(self._value(name))) for name, one in self.coordinates.items()}
        ends = list(accumulate([*counts.values(), COLOURS]))
        return {name: slice(*ends) for name, *ends in zip([*counts, "intensity"], [0, *ends], ends, strict=False)}

    @property
    def position(self) -> Tensor:
        """(3,) float64, scene units."""
        return self.light.position

    @property
    def axis(self) -> Tensor | None:
        """(3,) float64 of unit length, away from the light; None for one that shines alike in all directions."""
        return self.light.axis

    @cached_property
    def coordinates(self) -> dict[str, Coordinate]:
        """By the light's fields."""
        free = self.light.coordinates(self.shape_free)
        return free if self.mount is None else free | self.mount.coordinates(self.light)

    @cached_property
    def parameters(self) -> int:
        """D."""
        return sum(coordinate.count for coordinate in self.coordinates.values())

    def shining(self, intensity: Tensor) -> Light:
        """The light with `intensity` (3,)."""
        return replace(self.light, intensity=intensity)

    @property
    def told(self) -> Emitter:
        """The emitter by the numbers that results tell; itself where it is told by these."""
        light = self.light.told
        return self if light == self.light else replace(self, light=light)

    def placed(self, position: Tensor) -> Emitter:
        """The emitter at another place."""
        return replace(self, light=self.light.at(position))

    def softened(self, softness: float) -> Emitter:
        """The emitter with another softness."""
        return self if softness == self.softness else replace(self, softness=softness)

    def units(self, size: float) -> Tensor:
        """(D,) natural change (scene units, rad) per unit of each parameter, in a scene of `size`."""
        units = [unit for name, one in self.coordinates.items() for unit in one.units(self._value(name), size)]
        return torch.tensor(units, dtype=torch.float64)

    def moved(self, step: Tensor, size: float) -> Emitter:
        """After a step (D,) of the parameters."""
        light = self.light
        for name, coordinate, part in self._parts(step):
            light = light.changed(name, coordinate.moved(self._value(name), part, size))
        return replace(self, light=light)

    def offset(self, other: Emitter, size: float) -> Tensor:
        """(D,) parameters of `other` over those of this one, to first order."""
        pairs = ((name, one) for name, one in self.coordinates.items())
        return torch.cat([one.offset(self._value(name), other._value(name), size) for name, one in pairs])

    def distance(self, other: Emitter, size: float) -> float:
        """The largest of the move over the scene's size, the turn of the axis and the change of the shape [rad]."""
        movable, same = self.light.coordinates(shape_free=True), replace(other, light=other.light.like(self.light))
        return max(one.distance(self._value(name), same._value(name), size) for name, one in movable.items())

    def stretch(self, step: Tensor) -> tuple[float, float]:
        """How far a step (D,) moves over the scene's size, and how far it turns and reshapes [rad, or a parameter]."""
        stretches = [coordinate.stretch(part) for _, coordinate, part in self._parts(step)]
        return max(moved for moved, _ in stretches), max(turned for _, turned in stretches)

    def turned(self, other: Emitter) -> Tensor:
        """(D, D) from changes of the parameters here to those at `other`: axes have other tangents there."""
        blocks = [one.turned(self._value(name), other._value(name)) for name, one in self.coordinates.items()]
        return torch.block_diag(*blocks)

    def spread(self) -> Tensor:
        """(R, D) change of the light's own numbers, its axis as a vector, per natural change of each parameter."""
        blocks = [one.spread(self._value(name)) for name, one in self.coordinates.items()]
        return torch.block_diag(*blocks)

    def moving(self) -> Tensor:
        """(D,) bool: parameters that go on moving from frame to frame of a sequence."""
        flags = [one.motion is not None for one in self.coordinates.values() for _ in range(one.count)]
        return torch.tensor(flags)

    def carried(self, place: float, turn: float) -> Tensor:
        """(M, 6) its moving parameters per motion of the world: along x, y and z by `place`, in each by `turn`."""
        scales = {"place": (place, 0.0), "turn": (0.0, turn)}
        moving = [(one.spread(self._value(name)).T, one.motion) for name, one in self.coordinates.items() if one.motion]
        return torch.cat([torch.cat([scale * spread for scale in scales[how]], dim=1) for spread, how in moving])

    @cached_property
    def ways(self) -> Tensor | None:
        """(3, d) float64 where the first d parameters move it; None where it is free."""
        if self.mount is None:
            return None
        return self.coordinates["position"].slopes(self.position, torch.eye(3, dtype=torch.float64))

    def slopes(self, by: Mapping[str, Tensor]) -> Tensor:
        """(N, D) natural derivatives towards its parameters, scene units and rad, from those towards its fields."""
        by = self.light.tied_slopes(by)
        return torch.cat([one.slopes(self._value(name), by[name]) for name, one in self.coordinates.items()], dim=1)

    def _value(self, name: str) -> Tensor | float:
        return getattr(self.light, name)

    def _parts(self, step: Tensor) -> Iterator[tuple[str, Coordinate, Tensor]]:
        counts = [coordinate.count for coordinate in self.coordinates.values()]
        for (name, coordinate), part in zip(self.coordinates.items(), step.split(counts), strict=True):
            yield name, coordinate, part
