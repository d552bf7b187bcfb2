"""JSON files, read with errors that name the file and the key."""

from __future__ import annotations

import json
import math
from pathlib import Path

from rgspipe.errors import InputError


def read_json(path: str | Path, what: str) -> dict:
    """The object in a JSON file; `what` names its role in errors ("the cameras of the training views").

    Raises:
        InputError: missing, not JSON, or not an object at the top level.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(path, expected=what, found="no such file", remedy="Check the path.") from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, expected=what, found=f"an unreadable file ({error})", remedy="Check it.") from error
    except json.JSONDecodeError as error:
        raise InputError(path, expected=what, found=f"invalid JSON ({error})", remedy="Repair the file.") from error
    if not isinstance(content, dict):
        raise InputError(path, expected=f"{what} as a JSON object", found=type(content).__name__, remedy="Repair it.")
    return content


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
            where, expected=f'{count} finite numbers under "{key}"', found=repr(value)[:120], remedy=f'Correct "{key}".'
        )
    return [float(item) for item in value]


def is_number(value: object) -> bool:
    """Whether `value` is a finite JSON number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
