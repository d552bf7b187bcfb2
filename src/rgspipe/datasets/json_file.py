"""JSON files, read with errors that name the file and the key."""

from __future__ import annotations

import math
from pathlib import Path

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.errors import InputError
from rgspipe.store.strict_json import parse_json

#: Characters of a value that errors show.
LONGEST_SHOWN = 120


def read_json(path: str | Path, what: str) -> dict:
    """The object in a JSON file; `what` names its role in errors ("the cameras of the training views").

    Raises:
        InputError: as `read_json_value`, or not an object at the top level.
    """
    content = read_json_value(path, what)
    if not isinstance(content, dict):
        raise InputError(path, expected=f"{what} as a JSON object", found=type(content).__name__, remedy="Repair it.")
    return content


@timed
def read_json_value(path: str | Path, what: str) -> object:
    """What is in a JSON file, strictly: no key twice, no integer that a double cannot hold.

    Raises:
        InputError: missing, no regular file, too large or not JSON.
    """
    path = input_file(path, what, most_bytes=reading_limits().text_bytes)
    try:
        return parse_json(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, expected=what, found=f"an unreadable file ({error})", remedy="Check it.") from error
    except ValueError as error:
        raise InputError(path, expected=what, found=f"invalid JSON ({error})", remedy="Repair the file.") from error


def required(content: dict, key: str, where: str | Path) -> object:
    """`content[key]`, or an InputError that names the key."""
    if key not in content:
        listed = ", ".join(sorted(content)) or "nothing"
        raise InputError(where, expected=f'the key "{key}"', found=listed, remedy=f'Add "{key}".')
    return content[key]


def numbers(value: object, count: int, where: str | Path, key: str) -> list[float]:
    """`value` as a list of `count` finite floats, or an InputError that names the key."""
    good = isinstance(value, list) and len(value) == count and all(is_number(item) for item in value)
    if not good:
        raise InputError(
            where, expected=f'{_count(count)} under "{key}"', found=shown(value), remedy=f'Correct "{key}".'
        )
    return [float(item) for item in value]


def _count(count: int) -> str:
    return "a finite number" if count == 1 else f"{count} finite numbers"


def whole(value: object, where: str | Path, key: str) -> int:
    """`value` as a whole number, or an InputError that names the key."""
    if not is_number(value) or value != int(value):
        expected = f'a whole number under "{key}"'
        raise InputError(where, expected=expected, found=shown(value), remedy=f'Correct "{key}".')
    return int(value)


def is_number(value: object) -> bool:
    """Whether `value` is a finite JSON number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer that no double can hold
        return False


def shown(value: object) -> str:
    """A value as errors show it, which may be long."""
    text = repr(value)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}…"
