"""Light files: a rig of point and spot lights as JSON, in scene units, W/sr and world axes."""

from __future__ import annotations

from pathlib import Path

import torch

from rgspipe.datasets.json_file import is_number, numbers, read_json, required
from rgspipe.errors import InputError
from rgspipe.files import write_json
from rgspipe.scene import Light, LightRig, PointLight, SpotLight

VERSION = 1

#: The key of a spot profile's `falloff`.
FALLOFF_KEYS = {"gaussian": "falloff", "smoothstep": "blend", "linear": "beam_angle"}


def read_lights(path: str | Path) -> LightRig:
    """The lights of a light file, float64; fields that are not part of a light are ignored.

    Raises:
        InputError: missing or unreadable file, another version, unknown types, missing or impossible values.
    """
    content = read_json(path, "a light file")
    version = required(content, "version", path)
    if version != VERSION:
        raise InputError(
            path, expected=f'"version": {VERSION}', found=repr(version), remedy="Use the release that wrote this file."
        )
    lights = required(content, "lights", path)
    if not isinstance(lights, list) or not all(isinstance(light, dict) for light in lights):
        raise InputError(path, expected='a list of objects under "lights"', found=repr(lights)[:120], remedy="Fix it.")
    return tuple(_read_light(light, path, f"lights[{index}]") for index, light in enumerate(lights))


def write_lights(path: str | Path, rig: LightRig, extra: dict | None = None) -> None:
    """Write a rig; `extra` holds further top-level fields, its "lights" a list of further fields per light.

    Raises:
        ValueError: `extra` would overwrite a field of the format.
    """
    extra = dict(extra or {})
    further = extra.pop("lights", [{}] * len(rig))
    if len(further) != len(rig):
        raise ValueError(f'extra["lights"] must have {len(rig)} entries, got {len(further)}')
    lights = []
    for light, fields in zip(rig, further, strict=True):
        lights.append(_merged(_light_fields(light), fields))
    write_json(Path(path), _merged({"version": VERSION, "lights": lights}, extra))


def _merged(fields: dict, further: dict) -> dict:
    clash = fields.keys() & further.keys()
    if clash:
        raise ValueError(f"extra fields would overwrite {sorted(clash)}")
    return fields | further


def _light_fields(light: Light) -> dict:
    fields = {
        "type": "spot" if isinstance(light, SpotLight) else "point",
        "position": light.position.double().tolist(),
        "intensity": light.intensity.double().tolist(),
    }
    if isinstance(light, SpotLight):
        fields |= {"direction": light.direction.double().tolist(), "profile": light.profile}
        fields |= {"cone_angle": light.cone_angle, FALLOFF_KEYS[light.profile]: light.falloff}
    return fields


def _read_light(fields: dict, path: str | Path, where: str) -> Light:
    kind = required(fields, "type", f"{path}: {where}")
    position = _vector(fields, "position", path, where)
    intensity = _vector(fields, "intensity", path, where)
    if (intensity < 0).any():
        raise InputError(
            f"{path}: {where}.intensity", expected="W/sr ≥ 0", found=str(intensity.tolist()), remedy="Correct it."
        )
    if kind == "point":
        return PointLight(position, intensity)
    if kind != "spot":
        raise InputError(f"{path}: {where}.type", expected="point or spot", found=repr(kind), remedy="Correct it.")
    direction = _vector(fields, "direction", path, where)
    if direction.norm() == 0:
        raise InputError(
            f"{path}: {where}.direction", expected="a vector longer than 0", found="zero", remedy="Correct it."
        )
    profile = required(fields, "profile", f"{path}: {where}")
    if profile not in FALLOFF_KEYS:
        raise InputError(
            f"{path}: {where}.profile", expected=" or ".join(FALLOFF_KEYS), found=repr(profile), remedy="Correct it."
        )
    cone_angle, falloff = (_scalar(fields, key, path, where) for key in ("cone_angle", FALLOFF_KEYS[profile]))
    return SpotLight(position, intensity, direction / direction.norm(), profile, cone_angle, falloff)


def _vector(fields: dict, key: str, path: str | Path, where: str) -> torch.Tensor:
    place = f"{path}: {where}"
    return torch.tensor(numbers(required(fields, key, place), 3, place, key), dtype=torch.float64)


def _scalar(fields: dict, key: str, path: str | Path, where: str) -> float:
    value = required(fields, key, f"{path}: {where}")
    if not is_number(value):
        raise InputError(f"{path}: {where}.{key}", expected="a number", found=repr(value), remedy="Correct it.")
    return float(value)
