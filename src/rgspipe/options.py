"""Options: dataclasses that check what they are given, whoever gives it.

    @dataclass(frozen=True)
    class SearchOptions(Options):
        starts: int = option(4, low=1, high=4096)
        '''best candidates that are refined'''

The type of a field, its range and the text below it are all that is ever said of it: Python, the command line and its
help read them here. A field is bool, int, float, str, Path, a Literal of strings, a tuple of these, or other Options;
with `| None` its default depends on something else. Fields of other types are no settings, and nobody checks them.
"""

from __future__ import annotations

import ast
import dataclasses
import difflib
import inspect
import math
import sys
import types
import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, Self

from rgspipe.errors import InputError

#: Words that stand for a truth value.
TRUTHS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}

#: What is expected of a type, in words, and an example.
MEANINGS = {bool: ("true or false", "true"), int: ("a whole number", "8"), float: ("a number", "0.5")}
MEANINGS |= {str: ("text", "name"), Path: ("a path", "folder/file")}


def option(
    default: Any, *, low: float | None = None, high: float | None = None, choices: Sequence[str] | None = None
) -> Any:
    """A field with a range: `low` ≤ value ≤ `high`, or one of `choices`; of a tuple each value."""
    return dataclasses.field(default=default, metadata={"low": low, "high": high, "choices": choices})


@dataclass(frozen=True)
class Options:
    """The base of all options.

    Raises:
        InputError: a value has another type than its field, is out of its range, or is of no field; `where` is the
            field's name.
    """

    def __new__(cls, *args: Any, **values: Any) -> Self:
        check_names(values, [item.name for item in dataclasses.fields(cls)])
        return super().__new__(cls)

    def __post_init__(self) -> None:
        for item in settings(type(self)):
            object.__setattr__(self, item.name, item.checked(getattr(self, item.name)))
        self.check()

    def check(self) -> None:
        """Refuse values that do not go together.

        Raises:
            InputError: `where` is the name of a field.
        """


@dataclass(frozen=True)
class Setting:
    """One field of a class of options.

    Attributes:
        name: of the field.
        type: without `| None`; of a tuple that of its values.
        optional: whether it may be None.
        length: of a tuple; None if it has any, 0 for a single value.
        low, high: ends of its range.
        choices: what it may be, if that is listed.
        owner: the class that has the field.
    """

    name: str
    type: Any
    optional: bool
    length: int | None
    low: float | None
    high: float | None
    choices: tuple[str, ...]
    owner: type

    @property
    def section(self) -> type[Options] | None:
        """The class of the options that are nested here."""
        return self.type if issubclass(self.type, Options) else None

    @property
    def help(self) -> str:
        """The text below the field; empty where the source is not at hand."""
        for owner in self.owner.__mro__:
            if self.name in vars(owner).get("__annotations__", {}):
                return _texts(owner.__module__).get(owner.__qualname__, {}).get(self.name, "")
        return ""

    @property
    def range(self) -> str:
        """What it may be, in words: "draft | standard", "1 to 8", or nothing."""
        if self.choices:
            return " | ".join(self.choices)
        if self.low is None or self.high is None:
            return ""
        return f"{_short(self.low)} to {_short(self.high)}"

    def _nested(self, section: type[Options], value: Any) -> Options:
        """Options of this class, also of those by name that are not as they are by default."""
        if isinstance(value, section):
            return value
        names = [item.name for item in settings(section)]
        if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
            example = f"{self.name}={{{names[0]!r}: …}}"
            expected = f"values for some of {', '.join(names)}"
            raise self._refusal(expected, value, f"Give them as a dictionary, such as {example}.")
        try:
            return section(**value)
        except InputError as error:
            raise error.within(self.name) from None

    def checked(self, value: Any) -> Any:
        """The value in the field's own type.

        Raises:
            InputError: it is none.
        """
        if value is None and self.optional:
            return None
        if self.section is not None:
            return self._nested(self.section, value)
        if self.length == 0:
            return self._one(value)
        if isinstance(value, str) or not isinstance(value, Sequence):
            raise self._refusal("a list", value, "Write it in brackets, such as [1,2].")
        if self.length is not None and len(value) != self.length:
            raise self._refusal(f"{self.length} values", value, f"Write {self.length} values in brackets.")
        return tuple(map(self._one, value))

    def _one(self, value: Any) -> Any:
        value = self._typed(value)
        if self.choices and value not in self.choices:
            raise self._refusal(f"one of {', '.join(self.choices)}", value, "Choose one of them.")
        if self.low is None and self.high is None:
            return value
        low, high = -math.inf if self.low is None else self.low, math.inf if self.high is None else self.high
        if not (low <= value <= high and math.isfinite(value)):
            expected = f"a value from {_short(low)} to {_short(high)}" + (f" ({self.help})" if self.help else "")
            raise self._refusal(expected, value, "Choose a value in this range.")
        return value

    def _typed(self, value: Any) -> Any:
        """The value as the command line, YAML or Python may have it, in the field's type."""
        if self.type is bool and isinstance(value, str) and value.lower() in TRUTHS:
            return TRUTHS[value.lower()]
        if self.type in (str, Path) and value == "":
            # Mostly a variable of the shell that is not set; as a path it would be the folder that one is in.
            remedy = f"Leave it away{', or say null' if self.optional else ''}."
            raise self._refusal("text", "''", remedy)
        if isinstance(value, self.type) and (self.type is bool or not isinstance(value, bool)):
            return value
        try:
            # True is 1 for Python, 2.5 would be cut to 2, and whatever is text could be anything.
            if self.type in (int, float) and not isinstance(value, bool) and value is not None:
                number = self.type(value)
                if isinstance(value, str) or number == value or math.isnan(value):
                    return number
            if self.type in (str, Path) and isinstance(value, str | int | float | Path):
                return self.type(value)
        except (TypeError, ValueError, OverflowError):
            pass
        if value is None:
            raise self._refusal("a value", value, "Leave it away for its default.")
        meaning, example = MEANINGS[self.type]
        raise self._refusal(meaning, value, f"Write {example}, for instance.")

    def _refusal(self, expected: str, found: Any, remedy: str) -> InputError:
        return InputError(self.name, expected=expected, found=shown(found), remedy=remedy)


@cache
def settings(options: type[Options]) -> tuple[Setting, ...]:
    """The fields of a class of options, those of its bases first, without fields of other types than options have."""
    hints = typing.get_type_hints(options)
    found = (_setting(options, item, hints[item.name]) for item in dataclasses.fields(options))
    return tuple(setting for setting in found if setting is not None)


def _setting(owner: type, item: dataclasses.Field, hint: Any) -> Setting | None:
    parts = typing.get_args(hint)
    optional = types.NoneType in parts
    if optional:
        hint, *others = (part for part in parts if part is not types.NoneType)
        hint = object if others else hint
    length: int | None = 0
    if typing.get_origin(hint) is tuple:
        hint, *others = typing.get_args(hint)
        length = None if others == [...] else 1 + len(others)
    rule = item.metadata
    choices = rule.get("choices") or ()
    if typing.get_origin(hint) is Literal:
        hint, choices = str, typing.get_args(hint)
    if not inspect.isclass(hint) or not (hint in MEANINGS or issubclass(hint, Options)):
        return None
    return Setting(item.name, hint, optional, length, rule.get("low"), rule.get("high"), tuple(choices), owner)


def check_names(given: Iterable[str], names: Sequence[str], owner: str = "") -> None:
    """Refuse what is none of the names, with those that are like it.

    Raises:
        InputError: `where` is the name, after that of its owner if it has one.
    """
    for name in given:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=3)
            remedy = f"Did you mean {' or '.join(near)}?" if near else f"There are {', '.join(names)}."
            where = f"{owner}.{name}" if owner else name
            raise InputError(where, expected="the name of an option", found="no such option", remedy=remedy)


def shown(value: Any) -> str:
    """A value as people write it on the command line."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{','.join(map(shown, value))}]"
    return str(value)


def _short(number: float) -> str:
    return str(number) if isinstance(number, int) else f"{number:g}"


@cache
def _texts(module: str) -> dict[str, dict[str, str]]:
    """By class and field, the strings that stand below the fields of a module's classes."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (OSError, TypeError):
        return {}
    classes = (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    return {node.name: dict(_field_texts(node.body)) for node in classes}


def _field_texts(body: Sequence[ast.stmt]) -> Iterator[tuple[str, str]]:
    for field, text in pairwise(body):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(words))):
                yield name, " ".join(words.split())
