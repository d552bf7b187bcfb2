"""What callers hand to the library, looked at where it comes in: a path, a number, a count, or one of a kind."""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

from rgspipe.errors import InputError

One = TypeVar("One")

#: The largest count, such as a seed, that all libraries take.
LARGEST_COUNT = 2**31 - 1

#: Characters of a value that errors show.
SHOWN = 80


def as_path(path: str | os.PathLike[str], name: str = "path") -> Path:
    """A path whose name can be written down.

    Raises:
        InputError: something else, or a name that is no text, which neither JSON nor a terminal can say.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(name, expected="a path", found=_shown(path), remedy="Pass the name of a file or folder.")
    if path == "":  # which would be the folder that one is in
        raise InputError(name, expected="a path", found="no text", remedy="Pass the name of a file or folder.")
    made = Path(path)
    text = str(made)
    try:
        text.encode()
    except UnicodeEncodeError:
        remedy = "Rename it: its name has bytes that are no text in UTF-8, such as umlauts of an old archive."
        raise InputError(path, expected="a name in UTF-8", found="other bytes in it", remedy=remedy) from None
    if "\0" in text:
        raise InputError(text, expected="a path", found="a null in its name", remedy="Check the path.")
    return made


def as_file(path: str | os.PathLike[str], example: str) -> Path:
    """The path of a file that is to be written; `example` is a name that it may have.

    Raises:
        InputError: see `as_path`, or a folder has this name.
    """
    made = as_path(path)
    if made.is_dir():
        remedy = f"Add one: {example} in it."
        raise InputError(path, expected="the name of a file", found="a folder", remedy=remedy)
    return made


def as_number(
    value: object,
    name: str,
    remedy: str = "",
    *,
    expected: str = "a finite number",
    low: float = -math.inf,
    high: float = math.inf,
) -> float:
    """A finite number from `low` to `high`, of Python, numpy, or a tensor of one.

    Args:
        remedy: what errors tell to do; to pass a number, or one from `low` to `high`, if empty.

    Raises:
        InputError: something else.
    """
    try:
        number = math.nan if isinstance(value, str | bytes) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError, RuntimeError):  # what numpy and torch say of several numbers
        number = math.nan
    if not (math.isfinite(number) and low <= number <= high):
        usual = "Choose one in this range." if math.isfinite(number) else "Pass a number."
        raise InputError(name, expected=expected, found=_shown(value), remedy=remedy or usual)
    return number


def as_count(value: object, name: str, least: int = 1, remedy: str = "Pass a whole number.") -> int:
    """A whole number of at least `least`.

    Raises:
        InputError: something else.
    """
    number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not number or not least <= value <= LARGEST_COUNT or value != int(value):
        raise InputError(name, expected=f"a whole number, {least} or more", found=_shown(value), remedy=remedy)
    return int(value)


def as_one_of(value: object, kind: type[One], name: str, remedy: str) -> One:
    """A value that is of a kind.

    Raises:
        InputError: it is of another one.
    """
    if not isinstance(value, kind):
        raise InputError(name, expected=_one(kind), found=type(value).__name__, remedy=remedy)
    return value


def as_several(values: object, kinds: type[One] | tuple[type[One], ...], name: str, remedy: str) -> list[One]:
    """A list of values that are of a kind, or of one of several, from one of them or whatever holds some.

    Raises:
        InputError: it is none, and holds none, or others.
    """
    one, *_ = kinds if isinstance(kinds, tuple) else (kinds,)
    if isinstance(values, kinds):
        return [values]
    if not isinstance(values, Iterable):
        found = type(values).__name__
        raise InputError(name, expected=f"{_one(one)}, or a list of them", found=found, remedy=remedy)
    listed = list(values)
    for index, value in enumerate(listed):
        if not isinstance(value, kinds):
            found = type(value).__name__
            raise InputError(f"{name}[{index}]", expected=_one(one), found=found, remedy=remedy)
    return listed


def _one(kind: type) -> str:
    name = kind.__name__
    return f"{'an' if name[0] in 'AEIO' else 'a'} {name}"


def _shown(value: object) -> str:
    text = f"{type(value).__name__} {value!r}"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"
