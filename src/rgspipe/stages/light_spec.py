"""From what the configuration says of the lights that are looked for to a `LightSpec`."""

from __future__ import annotations

from rgspipe.config import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.fitting import LightSpec
from rgspipe.fitting.spec import shaped_kind
from rgspipe.scene.lights import KINDS
from rgspipe.stages.light_shape import light_shape


def light_spec(config: RgspipeConfig) -> LightSpec:
    """What the configuration says of the lights that are looked for.

    Raises:
        InputError: the paper's method is asked for lights of unknown type, number or cone.
    """
    if config.fit.method == "paper_adam":
        _refuse_unknowns(config)
    light, kind = config.light, shaped_kind(config.light.type)
    section = getattr(light, kind, None)
    shape = None if section is None else light_shape(kind, section, f"light.{kind}")
    mounted = light.mount == "surface"
    if mounted and not KINDS[kind].shaped().flush:
        remedy = "Use light=panel, or light.mount=free."
        raise InputError("light.mount", expected="free, but for panels", found="surface", remedy=remedy)
    return LightSpec(light.type, light.count, shape, config.fit.shape == "free", mounted, light.ambient)


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
    ]
    for key, expected, found, unknown in asked:
        if unknown:
            raise InputError(
                key,
                expected=f"{expected} with fit=paper_adam",
                found=found,
                remedy="Say what is known, or use fit=search_lm, which finds it out.",
            )
