"""From a scene's coordinates back to those of the file that it was made from, and to metres."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.scene import Light, LightRig
from rgspipe.scene.lights.shape_coordinates import Length

#: Luminous flux of a watt [lm/W], and the weights of R, G and B in it (Rec. 709): the convention of glTF and Blender.
LUMENS_PER_WATT, LUMINANCE = 683.0, (0.2126, 0.7152, 0.0722)


@dataclass(frozen=True)
class World:
    """How a scene's coordinates came about: scene = (file + offset) · rescale, and a unit of the file is `metres`.

    Attributes:
        metres: per unit of the file.
        rescale: scene units per unit of the file.
        offset: of the file's coordinates, in its units.
    """

    metres: float = 1.0
    rescale: float = 1.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def unit(self) -> float:
        """Metres per scene unit."""
        return self.metres / self.rescale

    def lights(self, rig: LightRig) -> LightRig:
        """The lights in metres, where they are in the file; intensities in W/sr go with the square of a unit.

        The irradiance of a sun stays: with lengths that are so many times longer, the same light arrives.
        """
        return tuple(self._light(light) for light in rig)

    def place(self, point: Tensor) -> Tensor:
        """Where a point (3,) of the scene is, in metres."""
        return self.metres * (point.double() / self.rescale - torch.tensor(self.offset, dtype=torch.float64))

    def _light(self, light: Light) -> Light:
        sizes = {
            number.name: self.unit * getattr(light, number.name)
            for number in light.shape
            if isinstance(number.coordinate, Length)
        }
        factor = 1.0 if light.distant else self.unit * self.unit
        return replace(light, position=self.place(light.position), intensity=factor * light.intensity.double(), **sizes)

    def line(self) -> str:
        """What was done, for people."""
        moved = "" if self.rescale == 1.0 and not any(self.offset) else ", where they are in the scene's own file"
        return (
            f"Lights in metres{moved}: a scene unit is {self.unit:g} m, so W/sr are {self.unit**2:g} times the fit's."
        )


def candela(light: Light) -> float:
    """Luminous intensity [cd] along its axis, of a sun illuminance [lx]: 683 lm/W of the luminance of its RGB."""
    return LUMENS_PER_WATT * float(light.intensity.double() @ torch.tensor(LUMINANCE, dtype=torch.float64))


def lumens(light: Light) -> float:
    """Luminous flux [lm], by the same convention."""
    return LUMENS_PER_WATT * float(light.power().double() @ torch.tensor(LUMINANCE, dtype=torch.float64))


def table(rig: LightRig) -> str:
    """The lights in radiometric and photometric units, a line each."""
    lines = ["light  kind     W/sr (R, G, B)              W (R, G, B)                        cd          lm"]
    for number, light in enumerate(rig, start=1):
        strength, power = (" ".join(f"{x:8.4g}" for x in part.tolist()) for part in (light.intensity, light.power()))
        lines.append(f"{number:5d}  {light.kind:7s} {strength}  {power}  {candela(light):10.4g}  {lumens(light):10.4g}")
    lines.append(f"cd and lm: {LUMENS_PER_WATT:g} lm/W of Rec. 709 luminance.")
    if any(light.distant for light in rig):
        lines.append("Of a sun W/m² and lx, on a surface across its light; its power has no end.")
    return "\n".join([*lines, ""])
