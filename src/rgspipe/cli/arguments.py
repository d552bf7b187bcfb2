"""Arguments of commands beside stages: what is misspelt is refused, with what it may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from rgspipe.cli.commands import COMMANDS
from rgspipe.errors import InputError


def meant(word: str, known: Sequence[str]) -> str:
    """What a misspelt word or KEY=VALUE may have meant, as a question; empty if nothing that is known is like it.

    Args:
        known: words as they are typed, keys up to the equals sign or with a value.
    """
    key, is_key, _ = word.partition("=")
    keys = dict.fromkeys(f"{name}{sign}" for name, sign, _ in (one.partition("=") for one in known))
    begin = f"{key}{is_key}"
    near = difflib.get_close_matches(*((word, known) if begin in keys else (begin, keys)), n=1)
    return f"Did you mean {near[0]}?" if near else ""


def refused(text: str, expected: str, command: str) -> InputError:
    """The error for an argument that a command does not know; `expected` says in words what can be said."""
    remedy = meant(text, COMMANDS[command].words) or f"rgspipe --help {command} says more."
    return InputError(repr(text), expected=expected, found="something else", remedy=remedy)
