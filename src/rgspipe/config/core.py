"""What all groups share: from plain values to options and back, by dotted key."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from rgspipe.errors import InputError
from rgspipe.options import Options, Setting, settings
from rgspipe.program import typed

Schema = TypeVar("Schema", bound=Options)

#: Keys that a misspelt one may have meant: so many are told at most.
SUGGESTED = 3


def build(schema: type[Schema], values: Mapping[str, Any], section: str = "") -> Schema:
    """Options from nested plain values, as YAML has them; what is not among them has its default.

    Args:
        section: the dotted key of these options, for errors.

    Raises:
        InputError: names the key that is wrong, what it may be and what it is.
    """
    known = {setting.name: setting for setting in settings(schema)}
    taken = {}
    for name, value in values.items():
        key = f"{section}.{name}" if section else str(name)
        if name not in known:
            raise unknown_key(key, [_joined(section, other) for other in known])
        taken[name] = _nested(known[name], value, key)
    return _made(lambda: schema(**taken), section)


def _nested(setting: Setting, value: Any, key: str) -> Any:
    if setting.section is None:
        return value
    if not isinstance(value, Mapping):
        first = settings(setting.section)[0].name
        remedy = f"{typed('--help', key)} lists them."
        raise InputError(key, expected=f"keys such as {key}.{first}", found=str(value), remedy=remedy)
    return build(setting.section, value, key)


def _made(make: Any, section: str) -> Any:
    """What `make` makes; errors that it raises are those of a section."""
    try:
        return make()
    except InputError as error:
        raise error.within(section) from None


def _joined(section: str, name: str) -> str:
    return f"{section}.{name}" if section else name


def unknown_key(key: str, known: Sequence[str]) -> InputError:
    """The error for a key that is not among those that are known."""
    return InputError(key, expected="a key of the configuration", found="no such key", remedy=_suggestion(key, known))


def _suggestion(key: str, known: Sequence[str]) -> str:
    like = difflib.get_close_matches(key, known, n=SUGGESTED, cutoff=0.7)
    # The right name in the wrong section, or in none, such as resolution= for dataset.resolution=.
    elsewhere, _, last = key.rpartition(".")
    same = [name for name in known if name.rpartition(".")[2] == last]
    near = list(dict.fromkeys([*like, *same] if elsewhere else [*same, *like]))[:SUGGESTED]
    if near:
        return f"Did you mean {' or '.join(near)}?"
    section = key.partition(".")[0]
    if section in known and section != key:
        return f"{typed('--help', section)} lists the keys of {section}."
    return f"{typed('--help')} lists the keys."


def plain(value: Any) -> Any:
    """Options as nested dictionaries, and whatever else is in them as JSON has it."""
    if isinstance(value, Options):
        return {item.name: plain(getattr(value, item.name)) for item in settings(type(value))}
    if isinstance(value, tuple):
        return [plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value


def get_value(config: Options, key: str) -> Any:
    """The value at a dotted key, as `plain` has it; ValueError if there is none."""
    value: Any = config
    for part in key.split("."):
        if part not in _names(value):
            raise ValueError(f"no configuration key {key!r}")
        value = getattr(value, part)
    return plain(value)


def with_changes(config: Schema, changes: Mapping[str, object]) -> Schema:
    """A copy with the values of dotted keys replaced, all at once.

    Raises:
        ValueError: a key does not exist.
        InputError: a value is of the wrong type or out of range, or values do not go together.
    """
    nested: dict[str, Any] = {}
    for key, value in changes.items():
        *path, last = key.split(".")
        place = nested
        for part in path:
            place = place.setdefault(part, {})
        place[last] = value
    return _replaced(config, nested, "")


def _replaced(node: Any, changes: Mapping[str, Any], section: str) -> Any:
    taken = {}
    for name, value in changes.items():
        key = _joined(section, name)
        if name not in _names(node):
            raise ValueError(f"no configuration key {key!r}")
        nested = isinstance(getattr(node, name), Options) and isinstance(value, Mapping)
        taken[name] = _replaced(getattr(node, name), value, key) if nested else value
    return _made(lambda: dataclasses.replace(node, **taken), section)


def _names(node: object) -> list[str]:
    return [setting.name for setting in settings(type(node))] if isinstance(node, Options) else []


def describe(options: Options, section: str = "") -> Iterator[tuple[str, str, Any]]:
    """(dotted key, help with the range, default) of every field of options and of those in them, in order."""
    for setting in settings(type(options)):
        key, value = _joined(section, setting.name), getattr(options, setting.name)
        if isinstance(value, Options):
            yield from describe(value, key)
        else:
            yield key, f"{setting.help} ({setting.range})" if setting.range else setting.help, value
