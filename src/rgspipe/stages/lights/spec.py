"""From what the configuration says of the lights that are looked for to a `LightSpec`."""

from __future__ import annotations

from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.config.light import LightConfig
from rgspipe.datasets.photometric_file import read_catalogue, read_photometry
from rgspipe.errors import InputError
from rgspipe.fitting import LightSpec
from rgspipe.fitting.spec import AUTO, shaped_kind
from rgspipe.options import settings
from rgspipe.scene.lights import KINDS, Photometry
from rgspipe.stages.lights.shape import light_shape


def light_keys(light: LightConfig) -> list[str]:
    """Those of `light` that count for the type that is looked for: shapes of other kinds do not."""
    kind = shaped_kind(light.type)
    return [f"light.{one.name}" for one in settings(LightConfig) if one.section is None or one.name == kind]


def light_spec(config: RgspipeConfig) -> LightSpec:
    """What the configuration says of the lights that are looked for.

    Raises:
        InputError: the paper's method is asked for lights of unknown type, number or cone.
    """
    if config.fit.method == "paper_adam":
        _refuse_unknowns(config)
    light, kind = config.light, shaped_kind(config.light.type)
    _refuse_tables_of_others(light)
    section, tables = getattr(light, kind, None), _tables(light)
    shape = None if section is None else light_shape(kind, section, f"light.{kind}")
    tabulated = shape is not None and shape.tabulated
    if shape is not None and tabulated and tables:
        shape = shape.with_tables(*tables)
    if light.distance is not None and light.mount == "free":
        remedy = "Say what they hang on: light.mount=surface or ceiling."
        found = f"{light.distance:g}"
        raise InputError("light.distance", expected="null, as nothing is hung on", found=found, remedy=remedy)
    free = config.fit.shape == "free" or (tabulated and light.catalogue is not None)
    luminaires = () if tabulated else tables
    return LightSpec(light.type, light.count, shape, free, light.mount, light.distance, light.ambient, luminaires)


def table_files(config: RgspipeConfig) -> list[Path]:
    """The files of measured luminaires that are named, read now: a wrong one should show before a scene is trained."""
    light_spec(config)
    given = [path for path in (config.light.file, config.light.catalogue) if path is not None]
    return [Path(path) for path in given]


def _tables(light: LightConfig) -> tuple[Photometry, ...]:
    """That of a file, or those of a catalogue; none if neither is named."""
    if light.file is not None and light.catalogue is not None:
        remedy = "Name one of them."
        raise InputError("light.catalogue", expected="null with light.file", found=light.catalogue, remedy=remedy)
    if light.file is not None:
        return (read_photometry(light.file),)
    return () if light.catalogue is None else tuple(read_catalogue(light.catalogue).values())


def _refuse_tables_of_others(light: LightConfig) -> None:
    types = [*(name for name, one in KINDS.items() if one.tabulated), AUTO]
    for name in ("file", "catalogue"):
        if (found := getattr(light, name)) is not None and light.type not in types:
            expected, remedy = f"null, but for light={' or '.join(types)}", "Use one of these, or leave it away."
            raise InputError(f"light.{name}", expected=expected, found=found, remedy=remedy)


def _refuse_unknowns(config: RgspipeConfig) -> None:
    """The paper's method moves a given number of lights of one type, with given cones.

    Raises:
        InputError: it is asked for others.
    """
    points = [name for name, kind in KINDS.items() if kind.shaped().in_one_point]
    asked = [
        ("light.type", " or ".join(points), config.light.type, config.light.type not in points),
        ("light.count", "a number from 1 to 8", "null", config.light.count is None),
        ("fit.shape", "known", config.fit.shape, config.fit.shape == "free"),
        ("light.ambient", "false", "true", config.light.ambient),
        ("light.mount", "free", config.light.mount, config.light.mount != "free"),
    ]
    for key, expected, found, unknown in asked:
        if unknown:
            raise InputError(
                key,
                expected=f"{expected} with fit=paper_adam",
                found=found,
                remedy="Say what is known, or use fit=search_lm, which finds it out.",
            )
