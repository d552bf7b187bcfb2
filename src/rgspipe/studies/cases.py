"""The cases of a study in words: which settings differ, and what the case is called."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import yaml

from rgspipe.errors import InputError

#: The case in which nothing differs.
CLEAN = "clean"


@dataclass(frozen=True)
class Case:
    """One row of a study.

    Attributes:
        name: what tables and figures call it.
        changes: values by dotted configuration key, as they are written.
    """

    name: str
    changes: dict[str, Any]


def parse_case(text: str, listed: str, section: str = "") -> Case:
    """A case such as "train.steps=0 views=50", "clean", or with a name of its own "few views: capture.views=25".

    Args:
        text: the case.
        listed: the configuration key that lists it, for messages.
        section: where keys without a dot belong; by default they are keys of the first level.

    Raises:
        InputError: it is neither `CLEAN` nor keys with values.
    """
    name, colon, settings = text.partition(":")
    if not colon or "=" in name:
        name, settings = text, text
    if not name.strip() or not settings.strip():
        raise _unclear(text, listed)
    changes: dict[str, Any] = {}
    for part in [] if settings.strip() == CLEAN else settings.split():
        key, equals, value = part.partition("=")
        if not equals or not key or not value:
            raise _unclear(text, listed)
        changes[key if "." in key or not section else f"{section}.{key}"] = _value(value, text, listed)
    return Case(" ".join(name.split()), changes)


def _value(written: str, text: str, listed: str) -> Any:
    try:
        return yaml.safe_load(written)
    except yaml.YAMLError:
        raise _unclear(text, listed) from None


def _unclear(text: str, listed: str) -> InputError:
    return InputError(
        listed,
        expected=f"{CLEAN}, or key=value, several joined by spaces, with a name in front where wanted",
        found=repr(text),
        remedy='Write it like "target_capture.noise=0.03" or "noise 3 %: target_capture.noise=0.03"; '
        "lists have no spaces in them.",
    )
