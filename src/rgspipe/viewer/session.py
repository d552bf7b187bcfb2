"""What one visitor of the viewer has changed: lamps, exposure and photographs, without any page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from rgspipe.datasets.light_file import write_lights
from rgspipe.errors import InputError
from rgspipe.evaluation.images import Bytes, display_gain, save_png, signed_difference, tone_map
from rgspipe.fitting import FitResult, LightSpec, fit_lights
from rgspipe.scene import Camera, LightRig
from rgspipe.scene.arrays import ArrayLike
from rgspipe.scene.lights import KINDS, Light
from rgspipe.viewer.false_colour import coloured
from rgspipe.viewer.lamp_images import LampImages, Quality

#: Kinds of lamps that are offered.
OFFERED = ("point", "spot", "sphere", "panel")

#: Steps that can be undone.
STEPS = 100


@dataclass(frozen=True, eq=False)
class Photograph:
    """An image (H, W, 3) of linear radiance and the camera that took it."""

    name: str
    camera: Camera
    image: Tensor


@dataclass(frozen=True, eq=False)
class Found:
    """Lamps that a search found, each with a covariance that begins with its position; none of those if not known."""

    lights: LightRig
    covariance: tuple[Tensor, ...] = ()


@dataclass
class Session:
    """The state of one visitor; scenes and what is kept of their images are shared.

    Attributes:
        images: of the scene.
        lights: the lamps that are on.
        photographs: of the scene under lamps that are looked for.
        truth: those lamps, where they are known.
        exposure: stops; at 0 the first picture's 97th percentile is white.
        irradiance: whether pictures show irradiance in false colours.
        found: lamps that a search found, with their covariances as `FitResult` has them.
    """

    images: LampImages
    lights: LightRig = ()
    photographs: list[Photograph] = field(default_factory=list)
    truth: LightRig = ()
    exposure: float = 0.0
    irradiance: bool = False
    found: Found | None = None
    _gain: float | None = None
    _past: list[LightRig] = field(default_factory=list)
    _gesture: str | None = None

    def change(self, lights: Sequence[Light], gesture: str | None = None) -> None:
        """Take other lamps. Changes in a row with one `gesture`, as of a drag, are undone together."""
        if gesture is None or gesture != self._gesture:
            self._past = [*self._past, self.lights][-STEPS:]
        self.lights, self._gesture = tuple(lights), gesture

    def replace(self, index: int, light: Light, gesture: str | None = None) -> None:
        """Another lamp in the place of one."""
        self.change([*self.lights[:index], light, *self.lights[index + 1 :]], gesture)

    def rest(self) -> None:
        """A gesture is over."""
        self._gesture = None

    def undo(self) -> bool:
        """Go back a step; whether there was any."""
        if not self._past:
            return False
        self.lights, self._gesture = self._past.pop(), None
        return True

    def add(self, kind: str = "point") -> int:
        """A lamp above the middle of the scene, as bright as the others are on average; its index."""
        lower, upper = (corner.double().cpu() for corner in self.images.frozen.bounds)
        middle = 0.5 * (lower + upper)
        position = torch.stack([middle[0], middle[1], middle[2] + 0.25 * (upper[2] - lower[2])])
        size = max(self.images.frozen.size, 1e-6)
        level = [float(light.intensity.mean()) for light in self.lights] or [0.5 * size**2]
        intensity = torch.full((3,), sum(level) / len(level), dtype=torch.float64)
        self.change([*self.lights, _of_kind(kind, position, intensity, None, size)])
        return len(self.lights) - 1

    def remove(self, index: int) -> None:
        """Take a lamp away."""
        self.change([*self.lights[:index], *self.lights[index + 1 :]])

    def as_kind(self, index: int, kind: str) -> None:
        """Make a lamp one of another kind, at its place, of its intensity and direction."""
        light = self.lights[index]
        self.replace(
            index, _of_kind(kind, light.position, light.intensity, light.axis, max(self.images.frozen.size, 1e-6))
        )

    def image(self, camera: Camera, quality: Quality = "sharp") -> Tensor:
        """(H, W, 3) linear radiance, or irradiance where that is shown."""
        render = self.images.irradiance if self.irradiance else self.images.image
        return render(camera, self.lights, quality)

    def picture(self, camera: Camera, quality: Quality = "sharp") -> tuple[Bytes, float]:
        """(H, W, 3) uint8 for the screen; and what its brightest colour stands for, linear units."""
        image = self.image(camera, quality)
        if self.irradiance:
            return coloured(image.mean(dim=2).numpy(), 2.0**self.exposure)
        if self._gain is None and image.any():
            self._gain = display_gain(image)
        factor = (self._gain or 1.0) * 2.0**self.exposure
        return tone_map(image, factor), 1.0 / factor

    def photograph(self, camera: Camera) -> Photograph:
        """Keep what a camera sees now; the lamps of now are the truth, and others' photographs are dropped."""
        if not same_lights(self.truth, self.lights):
            self.photographs = []
        taken = Photograph(
            f"photograph {len(self.photographs)}", camera, self.images.image(camera, self.lights, "sharp")
        )
        self.photographs.append(taken)
        self.truth = self.lights
        return taken

    def compared(self, index: int) -> Bytes:
        """A photograph, the picture of the lamps of now, and their signed difference, side by side."""
        taken = self.photographs[index]
        now, factor = self.images.image(taken.camera, self.lights, "sharp"), display_gain(taken.image)
        difference = signed_difference(taken.image, now, factor)
        return np.concatenate([tone_map(taken.image, factor), tone_map(now, factor), difference], axis=1)

    def search(self, lights: str | LightSpec = "auto") -> FitResult:
        """Find the lights of the photographs; `take` makes them the lamps.

        Raises:
            InputError: there are no photographs.
        """
        if not self.photographs:
            remedy = "Take one with the button, or start the viewer with target=DIR."
            raise InputError("photographs", expected="at least one to find the lights of", found="none", remedy=remedy)
        cameras, images = zip(*((taken.camera, taken.image) for taken in self.photographs), strict=True)
        return fit_lights(self.images.frozen, list(cameras), list(images), lights=lights)

    def take(self, result: FitResult) -> None:
        """Make what was found the lamps."""
        self.found = Found(result.lights, result.covariance)
        self.change(result.lights)

    def save(self, path: str | Path) -> None:
        """Write a light file."""
        write_lights(path, self.lights)

    def save_still(self, path: str | Path, camera: Camera) -> None:
        """Write the sharp picture as PNG."""
        save_png(path, self.picture(camera)[0])


def as_photographs(cameras: Sequence[Camera], images: Sequence[ArrayLike]) -> list[Photograph]:
    """Photographs of cameras and their images (H, W, 3)."""
    pairs = enumerate(zip(cameras, images, strict=True))
    return [Photograph(f"view {index}", camera, torch.as_tensor(image)) for index, (camera, image) in pairs]


def same_lights(one: LightRig, other: LightRig) -> bool:
    """Whether two rigs shine alike."""
    return len(one) == len(other) and all(_fields(a) == _fields(b) for a, b in zip(one, other, strict=True))


def _fields(light: Light) -> tuple:
    return light.kind, light.position.tolist(), light.intensity.tolist(), light.file_fields()


def _of_kind(kind: str, position: Tensor, intensity: Tensor, axis: Tensor | None, size: float) -> Light:
    """A lamp; one that has an extent begins with the smaller of those that a fit tries."""
    light = KINDS[kind].shaped().at(position, axis, intensity)
    grown = light.grown(size)
    return grown[0]
