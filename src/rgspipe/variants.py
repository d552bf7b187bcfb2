"""What an artifact is called that the plain command would not have made: the settings that make it another one."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence

#: Groups of presets, which set keys of any stage.
PRESETS = ("accuracy", "experiment")

#: Keys that say which scene is looked at, and where its results go: what is plain follows from them.
GIVEN = ("outputs", "scene")

#: A name that is longer ends in digits that tell it from others.
LONGEST, DIGITS = 100, 6


def plain_overrides(overrides: Sequence[str]) -> list[str]:
    """Those of a command that are left where it is plain: which scene, and where its results go."""
    return [text for text in overrides if _below(_key(text), GIVEN)]


def variant_name(overrides: Sequence[str], changes: Mapping[str, str], keys: Iterable[str]) -> str:
    """Such as "freeze.surfels=truth,views.count=3".

    Args:
        overrides: of the command.
        changes: values by dotted key that a stage asks of its inputs; they stand over those of the command.
        keys: dotted keys and sections that the artifact and all behind it depend on.
    """
    known = tuple(keys)
    wanted = {_key(text): text.lstrip("+~").partition("=")[2] for text in overrides} | changes
    texts = [
        f"{key}={value}"
        for key, value in sorted(wanted.items())
        if not _below(key, (*GIVEN, "stage")) and (key in PRESETS or _below(key, known) or _above(key, known))
    ]
    name = re.sub(r"[^\w.,=+-]+", "_", ",".join(texts), flags=re.ASCII)
    if len(name) <= LONGEST:
        return name
    return f"{name[: LONGEST - DIGITS - 1]}-{hashlib.sha256(name.encode()).hexdigest()[:DIGITS]}"


def _key(override: str) -> str:
    return override.split("=")[0].lstrip("+~")


def _below(key: str, sections: Iterable[str]) -> bool:
    """Whether a key is one of the sections, or in one."""
    return any(key == section or key.startswith(f"{section}.") for section in sections)


def _above(key: str, others: Iterable[str]) -> bool:
    """Whether one of the others is in the section, or group, that is called like the key."""
    return any(other.startswith(f"{key}.") for other in others)
