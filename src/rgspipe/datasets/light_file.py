"""Light files: a rig as JSON, in scene units, W/sr and world axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.arguments import as_file
from rgspipe.datasets.json_file import is_number, numbers, read_json, required, shown
from rgspipe.datasets.limits import FARTHEST, STRONGEST
from rgspipe.errors import InputError
from rgspipe.scene.lights import KINDS, Light, LightRig, as_rig, check_numbers
from rgspipe.store.files import write_json

VERSION = 1

#: The entry of light that comes from all around, and what it says of it.
AMBIENT, RADIANCE = "ambient", "radiance"

#: Vectors shorter than this are enlarged before they are squared.
TINY = 1e-100

#: The field of a file whose lights are not in the scene's units and axes: by which they came out of these.
WORLD = "world"


def read_lights(path: str | Path, *, any_world: bool = False) -> LightRig:
    """The lights of a light file, float64; fields that are not part of a light are ignored.

    Args:
        any_world: whether to take lights that were exported to other units and places than the scene's, too.

    Raises:
        InputError: missing or unreadable file, another version, unknown types, missing or impossible values; or lights
            that were exported for other programs.
    """
    content = read_json(path, "a light file")
    if not content.keys() & {"version", "lights"}:
        found, remedy = ", ".join(sorted(content)) or "nothing", "Name a light file, such as a fit's lights.json."
        raise InputError(path, expected='a light file, with "version" and "lights"', found=found, remedy=remedy)
    version = required(content, "version", path)
    if version != VERSION:
        raise InputError(
            path, expected=f'"version": {VERSION}', found=repr(version), remedy="Use the release that wrote this file."
        )
    if WORLD in content and not any_world:
        raise InputError(
            path,
            expected="lights in the scene's units and axes",
            found=f"those of an export, {content[WORLD]!r}"[:120],
            remedy="Take the lights.json that was exported; in Python, read_lights(…, any_world=True) reads these.",
        )
    return lights_in(content, path)


def lights_in(content: dict, place: str | Path) -> LightRig:
    """The lights of an object that has a list of them, float64.

    Args:
        place: of the object, for errors.

    Raises:
        InputError: there is no list, or unknown types, missing or impossible values are in it.
    """
    lights = required(content, "lights", place)
    if not isinstance(lights, list) or not all(isinstance(light, dict) for light in lights):
        raise InputError(place, expected='a list of objects under "lights"', found=repr(lights)[:120], remedy="Fix it.")
    return tuple(_read_light(light, place, f"lights[{index}]") for index, light in enumerate(lights))


def read_ambient(path: str | Path) -> Tensor | None:
    """The RGB radiance (3,) float64 of the void in a light file; None where it says nothing of it.

    Raises:
        InputError: missing or unreadable file, or impossible values.
    """
    content = read_json(path, "a light file")
    if AMBIENT not in content:
        return None
    place = f"{path}: {AMBIENT}"
    if not isinstance(content[AMBIENT], dict):
        expected, found = f'an object with "{RADIANCE}"', shown(content[AMBIENT])
        raise InputError(place, expected=expected, found=found, remedy="Correct it.")
    radiance = numbers(required(content[AMBIENT], RADIANCE, place), 3, place, RADIANCE)
    if min(radiance) < 0 or max(radiance) > STRONGEST:
        expected = f"radiance from 0 to {STRONGEST:g}"
        raise InputError(f"{place}.{RADIANCE}", expected=expected, found=str(radiance), remedy="Correct it.")
    return torch.tensor(radiance, dtype=torch.float64)


def ambient_fields(radiance: Tensor | None) -> dict:
    """Of a light file, what `read_ambient` reads from it: (3,) radiance; nothing of None."""
    return {} if radiance is None else {AMBIENT: {RADIANCE: radiance.tolist()}}


def write_lights(path: str | Path, lights: Light | Sequence[Light], extra: dict | None = None) -> None:
    """Write lights; `extra` holds further top-level fields, its "lights" a list of further fields per light.

    Raises:
        InputError: `path` is a folder, or `lights` are none, or have numbers that are not finite, positions or
            intensities too large to be read, or intensities below 0.
        ValueError: `extra` would overwrite a field of the format.
    """
    path = as_file(path, "lights.json")
    rig = as_rig(lights)
    check_numbers(rig)
    extra = dict(extra or {})
    further = extra.pop("lights", [{}] * len(rig))
    if len(further) != len(rig):
        raise ValueError(f'extra["lights"] must have {len(rig)} entries, got {len(further)}')
    entries = [_merged(light_fields(light), fields) for light, fields in zip(rig, further, strict=True)]
    for index, fields in enumerate(entries):
        _placed(_Fields(fields, f"{path}: lights[{index}]"))
    write_json(path, _merged({"version": VERSION, "lights": entries}, extra))


def _merged(fields: dict, further: dict) -> dict:
    clash = fields.keys() & further.keys()
    if clash:
        raise ValueError(f"extra fields would overwrite {sorted(clash)}")
    return fields | further


def light_fields(light: Light) -> dict:
    """A light as a light file has it."""
    fields = {"type": light.kind}
    fields |= {name: getattr(light, name).double().tolist() for name in ("position", "intensity")}
    return fields | light.file_fields()


def _placed(reader: _Fields) -> tuple[Tensor, Tensor]:
    """Position (3,) and intensity (3,) of a light, whatever its kind, within what files may have."""
    position, intensity = reader.vector("position"), reader.vector("intensity")
    if (position.abs() > FARTHEST).any():
        raise reader.refusal("position", f"coordinates within ±{FARTHEST:g}", str(position.tolist()))
    if (intensity < 0).any() or (intensity > STRONGEST).any():
        raise reader.refusal("intensity", f"W/sr from 0 to {STRONGEST:g}", str(intensity.tolist()))
    return position, intensity


def _read_light(fields: dict, path: str | Path, where: str) -> Light:
    reader = _Fields(fields, f"{path}: {where}")
    kind = KINDS[reader.choice("type", tuple(KINDS))]
    position, intensity = _placed(reader)
    try:
        light = kind.from_fields(position, intensity, reader)
    except InputError as error:
        # What the reader refuses names the file; what no light can have names the light's own number alone.
        raise error if error.where.startswith(reader.place) else error.within(reader.place) from None
    except ValueError as error:
        raise InputError(
            reader.place, expected=f"a {kind.kind} light", found=str(error), remedy="Correct it."
        ) from error
    for number in light.shape:
        # The limit, but for the rounding of whoever wrote it.
        if (value := float(getattr(light, number.name))) > number.largest * (1.0 + 1e-9):
            raise reader.refusal(number.key, f"at most {number.largest:g}", f"{value:g}")
    return light


@dataclass(frozen=True)
class _Fields:
    """The fields of one light; see `rgspipe.scene.lights.reader.Reader`."""

    fields: dict
    place: str

    def vector(self, key: str) -> torch.Tensor:
        return torch.tensor(numbers(required(self.fields, key, self.place), 3, self.place, key), dtype=torch.float64)

    def direction(self, key: str) -> torch.Tensor:
        vector = self.vector(key)
        if not 0.0 < vector.abs().max() <= FARTHEST:
            raise self.refusal(key, f"a vector longer than 0, of numbers within ±{FARTHEST:g}", str(vector.tolist()))
        # Squares of tiny numbers would be 0.
        vector = vector / vector.abs().max() if vector.norm() < TINY else vector
        return vector / vector.norm()

    def number(self, key: str) -> float:
        value = required(self.fields, key, self.place)
        if not is_number(value):
            raise self.refusal(key, "a number", repr(value))
        if abs(value) > FARTHEST:
            raise self.refusal(key, f"a number within ±{FARTHEST:g}", repr(value))
        return float(value)

    def text(self, key: str) -> str:
        value = required(self.fields, key, self.place)
        if not isinstance(value, str):
            raise self.refusal(key, "a text", repr(value)[:80])
        return value

    def numbers(self, key: str) -> torch.Tensor:
        values = required(self.fields, key, self.place)
        if not (isinstance(values, list) and values and all(map(is_number, values))):
            raise self.refusal(key, "a list of numbers", repr(values)[:80])
        if max(map(abs, values)) > FARTHEST:
            raise self.refusal(key, f"numbers within ±{FARTHEST:g}", repr(values)[:80])
        return torch.tensor(values, dtype=torch.float64)

    def choice(self, key: str, names: Sequence[str]) -> str:
        value = required(self.fields, key, self.place)
        if value not in names:
            raise self.refusal(key, " or ".join(names), repr(value))
        return value

    def refusal(self, key: str, expected: str, found: str) -> InputError:
        return InputError(f"{self.place}.{key}", expected=expected, found=found, remedy="Correct it.")
