"""The one exception that is meant for people: what was wrong, where, and what to do about it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path


class InputError(ValueError):
    """Input that cannot be used: a file, a folder, a configuration key or an argument.

    The message is one paragraph that names the place, what was expected, what was found and what to
    do. The command line prints it without a traceback and exits with status 2; library callers can
    read the parts as attributes. Options are named as Python has them, such as CaptureOptions(exposure='same'),
    which the command line tells as its own keys: see `config.spoken`.

    Args:
        where: the file, folder or configuration key that is wrong.
        expected: what a usable input would have been.
        found: what was there instead.
        remedy: what the reader can do now.
    """

    def __init__(self, where: str | Path, *, expected: str, found: str, remedy: str) -> None:
        self.where, self.expected, self.found, self.remedy = str(where), expected, found, remedy
        super().__init__(printable(f"{where}: expected {expected}, found {found}. {remedy}"))

    def within(self, section: str) -> InputError:
        """The same error where what is wrong is part of something larger: `section` and a dot before its name."""
        where = f"{section}.{self.where}" if section else self.where
        return InputError(where, expected=self.expected, found=self.found, remedy=self.remedy)

    def reworded(self, words: Callable[[str], str]) -> InputError:
        """The same error in the words of another reader, such as with keys of the command line for names in Python."""
        expected, found, remedy = map(words, (self.expected, self.found, self.remedy))
        return InputError(words(self.where), expected=expected, found=found, remedy=remedy)


def printable(text: str) -> str:
    """The text with what would steer a terminal, or cannot be printed, as escapes: it may be a stranger's."""
    return "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in text)
