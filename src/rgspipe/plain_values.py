"""Values that people type as they are, such as names of folders with umlauts, in the words of Hydra's grammar."""

from __future__ import annotations

import re
from pathlib import Path

#: Characters that Hydra reads without quotes.
READ = re.compile(r"[A-Za-z0-9_ \t/%@.:?|*+\\-]*")

#: What means something in Hydra's grammar: lists, choices, quoted text, interpolations, and its functions.
MEANT = re.compile(r"""[\[\]{},"$]|^'|^\w+\(""")


def as_typed(argument: str) -> str:
    """KEY=VALUE as Hydra reads it, with quotes around a value that it would not read without; others as they are.

    A value that begins with `~/` is a path below the home folder, which shells see only in the names of variables.
    """
    key, is_key, value = argument.partition("=")
    if not is_key or key.startswith("-") or MEANT.search(value):
        return argument
    if value == "~" or value.startswith("~/"):
        value = str(Path(value).expanduser())
    return f"{key}={value}" if READ.fullmatch(value) else f"{key}={quoted(value)}"


def as_shown(argument: str) -> str:
    """KEY=VALUE as it was typed, without the quotes that `as_typed` puts around it."""
    key, _, value = argument.partition("=")
    inner = re.sub(r"(\\+)('|$)", lambda found: found[1][: len(found[1]) // 2] + found[2], value[1:-1])
    return f"{key}={inner}" if as_typed(f"{key}={inner}") == argument else argument


def quoted(text: str) -> str:
    """A text as Hydra reads it whatever it holds: backslashes escape quotes, and themselves before one alone."""
    inner = re.sub(r"(\\*)('|$)", lambda found: 2 * found[1] + ("\\'" if found[2] else ""), text)
    return f"'{inner}'"
