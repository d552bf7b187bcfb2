"""What an artifact is called that is one of several to compare: the settings that tell it from the plain one.

Settings vary in a sweep, where a stage needs an input with others than its own, and where the keys below are set: they
ask what another scene than the one that is there would give.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from rgspipe.config.compared import OTHER_METHOD, OTHER_SCENE

#: Keys and sections that are for comparisons.
COMPARED = (OTHER_METHOD, *OTHER_SCENE)

#: The group of methods, whose members set `fit.method`.
METHODS = "fit"

#: A name that is longer ends in digits that tell it from others.
LONGEST, DIGITS = 100, 6


def plain_overrides(overrides: Sequence[str], swept: Collection[str]) -> list[str]:
    """Those of a command that do not vary.

    Args:
        swept: keys and groups of which a sweep tries several values.
    """
    return [text for text in overrides if not _varies(key_of(text), swept)]


def variant_name(
    overrides: Sequence[str], swept: Collection[str], changes: Mapping[str, str], keys: Collection[str]
) -> str:
    """Such as "freeze.surfels=truth,views.count=3"; empty if nothing varies that matters.

    Args:
        overrides: of the command.
        swept: keys and groups of which a sweep tries several values.
        changes: values by dotted key that a stage asks of its inputs; they stand over those of the command.
        keys: dotted keys and sections that the artifact and all behind it depend on.
    """
    given = {key_of(text): text.partition("=")[2] for text in overrides if _varies(key_of(text), swept)}
    texts = [
        f"{key}={value}"
        for key, value in sorted((given | changes).items())
        if below(key, keys) or any(below(other, (key,)) for other in keys)
    ]
    name = re.sub(r"[^\w.,=+-]+", "_", ",".join(texts), flags=re.ASCII)
    if len(name) <= LONGEST:
        return name
    return f"{name[: LONGEST - DIGITS - 1]}-{hashlib.sha256(name.encode()).hexdigest()[:DIGITS]}"


def key_of(override: str) -> str:
    """The key, or the group, that an override of the command line is of."""
    return override.split("=")[0].lstrip("+~")


def _varies(key: str, swept: Collection[str]) -> bool:
    return key in swept or key == METHODS or below(key, COMPARED)


def below(key: str, sections: Iterable[str]) -> bool:
    """Whether a key is one of the sections, or in one."""
    return any(key == section or key.startswith(f"{section}.") for section in sections)
