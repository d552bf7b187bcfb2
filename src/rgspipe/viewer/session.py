"""What one visitor of the viewer has changed: lamps, picture and photographs, without any page."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.light_file import ambient_fields, write_lights
from rgspipe.evaluation.images import Bytes, beside, display_gain, save_png, signed_difference, tone_map
from rgspipe.fitting import FitResult
from rgspipe.light_export.world import LUMENS_PER_WATT, LUMINANCE
from rgspipe.scene import Camera, LightRig
from rgspipe.scene.lights import Light, Photometry
from rgspipe.viewer.false_colour import coloured
from rgspipe.viewer.lamp_images import LampImages, Quality
from rgspipe.viewer.lamp_kinds import in_place_of, irradiance, made
from rgspipe.viewer.material import Case, Found, Photograph
from rgspipe.viewer.section import CutCamera

#: What pictures show: radiance as a photograph, or what arrives on surfaces in false colours.
PICTURE, IRRADIANCE, ILLUMINANCE = "picture", "irradiance, W/m²", "illuminance, lux"
SHOWN = (PICTURE, IRRADIANCE, ILLUMINANCE)

#: Two answers are one where their lamps are no farther apart, of the scene's size; suns by the angle [rad].
SAME = 0.01

#: How far from one another lamps are that are added one after the other, of the scene's size.
GAP = 0.1

#: Steps that can be undone.
STEPS = 100

#: Where lamps shine that had no axis.
DOWN = torch.tensor([0.0, 0.0, -1.0], dtype=torch.float64)


@dataclass
class Session:
    """The state of one visitor; scenes and what is kept of their images are shared.

    Attributes:
        images: of the scene.
        lights: the lamps that are on.
        ambient: (3,) radiance that comes from all around through openings besides; black if None.
        is_open_to_it: whether pictures for the screen have that; photographs do.
        case: photographs of the scene under lamps that are looked for.
        exposure: stops; at 0 the 97th percentile of the first photograph, or else of the first picture, is white.
        shown: one of SHOWN.
        section: axis and place of a plane that cuts away what is on the camera's side of it; None for none.
        found: lamps that a search found.
        held: whether a lamp is being dragged.
    """

    images: LampImages
    lights: LightRig = ()
    ambient: Tensor | None = None
    is_open_to_it: bool = True
    case: Case = field(default_factory=Case)
    exposure: float = 0.0
    shown: str = PICTURE
    section: tuple[int, float] | None = None
    found: Found | None = None
    held: bool = False
    _gain: float | None = None
    _past: list[LightRig] = field(default_factory=list)
    _gesture: str | None = None
    _shapes: dict[str, Light] = field(default_factory=dict)

    def change(self, lights: Sequence[Light], gesture: str | None = None) -> None:
        """Take other lamps. Changes in a row with one `gesture`, as of a drag, are undone together."""
        if gesture is None or gesture != self._gesture:
            self._past = [*self._past, self.lights][-STEPS:]
        self.lights, self._gesture = tuple(lights), gesture

    def replace(self, index: int, light: Light, gesture: str | None = None) -> None:
        """Another lamp in the place of one."""
        self.change([*self.lights[:index], light, *self.lights[index + 1 :]], gesture)

    def rest(self) -> None:
        """Nothing has changed for a while: a gesture is over, but for a drag whose lamp is still held."""
        if not self.held:
            self._gesture = None

    def undo(self) -> bool:
        """Go back a step; whether there was any."""
        if not self._past:
            return False
        self.lights, self._gesture = self._past.pop(), None
        return True

    def forget(self) -> None:
        """What was done so far cannot be undone."""
        self._past, self._gesture = [], None

    def add(self, kind: str = "point") -> int:
        """A lamp above the middle of the scene, or beside those that are there, as bright as the mean; its index."""
        self.change([*self.lights, self._further(kind, self.lights)])
        return len(self.lights) - 1

    def _further(self, kind: str, others: LightRig) -> Light:
        lower, upper = (corner.double().cpu() for corner in self.images.frozen.bounds)
        middle = 0.5 * (lower + upper)
        above = torch.stack([middle[0], middle[1], middle[2] + 0.25 * (upper[2] - lower[2])])
        size = max(self.images.frozen.size, 1e-6)
        taken = [light.position for light in others]
        position = next(one for one in _around(above, GAP * size) if _is_free(one, taken, 0.5 * GAP * size))
        level = [irradiance(light, size) * float(light.intensity.mean()) for light in others] or [2.0]
        lamp = made(kind, size)
        intensity = torch.full((3,), sum(level) / len(level) / irradiance(lamp, size), dtype=torch.float64)
        return lamp.at(position, DOWN, intensity)

    def remove(self, index: int) -> None:
        """Take a lamp away."""
        self.change([*self.lights[:index], *self.lights[index + 1 :]])

    def as_kind(self, index: int, kind: str, aim: Tensor = DOWN) -> None:
        """Make a lamp one of another kind, of the shape of one that was or is there, if any.

        Args:
            aim: see `in_place_of`.
        """
        light, size = self.lights[index], max(self.images.frozen.size, 1e-6)
        self._shapes[light.kind] = light
        there = (one for one in self.lights if one.kind == kind)
        model = self._shapes.get(kind) or next(there, None) or made(kind, size)
        self.replace(index, in_place_of(light, model, size, aim))

    def as_luminaire(self, index: int, table: Photometry) -> None:
        """Make a lamp whose shape is a table's a measured luminaire."""
        self.replace(index, self.lights[index].with_tables(table))

    def seen(self, camera: Camera) -> Camera:
        """A camera with the section before it."""
        return camera if self.section is None else CutCamera.of(camera, *self.section)

    def image(self, camera: Camera, quality: Quality = "sharp") -> Tensor:
        """(H, W, 3) linear radiance, or irradiance where that is shown."""
        render = self.images.image if self.shown == PICTURE else self.images.irradiance
        return render(camera, self.lights, quality, self.ambient if self.is_open_to_it else None)

    def picture(self, camera: Camera, quality: Quality = "sharp") -> tuple[Bytes, float]:
        """(H, W, 3) uint8 for the screen; and what its brightest colour stands for."""
        [picture], top = self.pictures([self.image(camera, quality)])
        return picture, top

    def pictures(self, images: Sequence[Tensor]) -> tuple[list[Bytes], float]:
        """What `image` gave of several cameras for the screen, all on one scale; and what their brightest colour is."""
        if self.shown == IRRADIANCE:
            return coloured([image.mean(dim=2).numpy() for image in images], 2.0**self.exposure)
        if self.shown == ILLUMINANCE:
            eye = LUMENS_PER_WATT * torch.tensor(LUMINANCE)
            return coloured([(image @ eye).numpy() for image in images], 2.0**self.exposure)
        if self._gain is None:
            self._gain = next((display_gain(image) for image in images if image.any()), None)
        factor = (self._gain or 1.0) * 2.0**self.exposure
        return [tone_map(image, factor) for image in images], 1.0 / factor

    def photograph(self, camera: Camera) -> Photograph:
        """Keep what a camera sees now; the lamps of now are the truth, and others' photographs are dropped."""
        kept = self.case.photographs if same_lights(self.case.truth, self.lights) else ()
        image = self.images.image(camera, self.lights, "sharp", self.ambient)
        taken = Photograph(f"photograph {len(kept)}", camera, image)
        self.case = Case("taken here", (*kept, taken), self.lights)
        return taken

    def compared(self, photograph: Photograph) -> Bytes:
        """A photograph, the picture from its camera, and their signed difference, side by side.

        The picture is that of the lamps of the photograph where these are known, else of those of now, in the exposure
        that was found and clipped where the photograph is. What the photograph shows with the lamps off is in it, and
        what was found to come from all around.
        """
        own = photograph.lights
        rig, ambient = (self.lights, self.ambient) if own is None else (own, None)
        now, factor = self.images.image(photograph.camera, rig, "sharp", ambient), display_gain(photograph.image)
        now = self._exposure_of(photograph) * now
        if photograph.base is not None:
            scale = None if self.found is None else self.found.base_scale
            now = now + photograph.base.to(now) * (1.0 if scale is None else scale.to(now))
        now = photograph.explained(now)
        difference = signed_difference(photograph.image, now, factor)
        return beside([tone_map(photograph.image, factor), tone_map(now, factor), difference])

    def _exposure_of(self, photograph: Photograph) -> float:
        """Over that of the first photograph of the case, as a search found it; 1 where none did."""
        exposures = () if self.found is None else self.found.exposures
        pairs = zip(self.case.photographs, exposures, strict=False)
        return next((exposure for taken, exposure in pairs if taken is photograph), 1.0)

    @property
    def found_now(self) -> Found | None:
        """What a search found, as far as the lamps of now are those; None where they are others."""
        return self.found if self.found is not None and same_lights(self.found.lights, self.lights) else None

    def open(self, case: Case) -> None:
        """Look at other photographs, and at what a fit found in them.

        What was found in those before is nothing to compare these with: a lamp above the middle takes its place.
        """
        former = self.found
        self.case, self.found = case, case.found
        if case.photographs:
            self._gain = display_gain(case.photographs[0].image)
        if case.found is not None:
            self.ambient = case.found.ambient
            self.change(case.found.lights)
        elif former is not None:
            self.ambient = None
            self.change([self._further("point", ())])

    def take(self, result: FitResult, searched: bool = True) -> None:
        """Make what was found the lamps.

        Args:
            searched: whether it was weighed against others. What was not, but is what was found before, has the
                others of then; elsewhere there are none, as those of then were weighed against another answer.
        """
        found, before = Found.of(result), self.found
        if not searched and before is not None and alike(found.lights, before.lights, self.images.frozen.size):
            found = replace(found, alternatives=before.alternatives, costs=before.costs)
        self.found, self.ambient = found, found.ambient
        self.change(result.lights)

    def save(self, path: str | Path) -> None:
        """Write a light file, with what the fit says of its lamps where they are those of now."""
        found = self.found_now
        write_lights(path, self.lights, ambient_fields(self.ambient) | ({} if found is None else found.fields))

    def save_still(self, path: str | Path, camera: Camera) -> None:
        """Write the sharp picture as PNG."""
        save_png(path, self.picture(self.seen(camera))[0])


def same_lights(one: LightRig, other: LightRig) -> bool:
    """Whether two rigs shine alike."""
    return len(one) == len(other) and all(_fields(a) == _fields(b) for a, b in zip(one, other, strict=True))


def alike(one: LightRig, other: LightRig, size: float) -> bool:
    """Whether two rigs in a scene of `size` are of the same kinds in the same order, each lamp near the other's."""
    if [light.kind for light in one] != [light.kind for light in other]:
        return False
    pairs = zip(one, other, strict=True)
    return all(float((a.standing(size) - b.standing(size)).norm()) <= SAME * size for a, b in pairs)


def _fields(light: Light) -> tuple:
    return light.kind, light.position.tolist(), light.intensity.tolist(), light.file_fields()


def _is_free(place: Tensor, taken: Sequence[Tensor], distance: float) -> bool:
    return all(float((other - place).norm()) > distance for other in taken)


def _around(middle: Tensor, gap: float) -> Iterator[Tensor]:
    """Places at the height of `middle` (3,), outwards on a sunflower's spiral: neighbours are about `gap` apart."""
    for number in itertools.count():
        angle, radius = number * math.pi * (3.0 - math.sqrt(5.0)), gap * math.sqrt(number)
        yield middle + torch.tensor([radius * math.cos(angle), radius * math.sin(angle), 0.0], dtype=torch.float64)
