"""What people read when something goes wrong."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
import traceback
from pathlib import Path

from rgspipe.config.spoken import as_keys
from rgspipe.errors import InputError

#: Exit status of a run that failed, of one whose input cannot be used, of one that was stopped with Ctrl-C, and of one
#: whose output nobody reads any more.
EXIT_FAILED, EXIT_INPUT, EXIT_INTERRUPTED, EXIT_UNREAD = 1, 2, 130, 141

TRACEBACK_VARIABLE = "RGSPIPE_TRACEBACK"

#: Columns of a message where there is no terminal, and the most on a wide one.
WIDTH = 110


def line_width(most: int = WIDTH) -> int:
    """How many letters a line may have: those of the terminal, where there is one and it has fewer than `most`."""
    return min(most, shutil.get_terminal_size((most, 24)).columns)


def traceback_wanted(option: bool = False) -> bool:
    """Whether tracebacks go to the terminal: `debug.traceback=true` or RGSPIPE_TRACEBACK=1."""
    return option or os.environ.get(TRACEBACK_VARIABLE, "") not in ("", "0")


def show_input_error(error: InputError, option: bool = False) -> None:
    """One paragraph on stderr; the traceback before it only if asked for."""
    if traceback_wanted(option):
        traceback.print_exception(error, file=sys.stderr)
    # A path that is longer than a line stays behind the word.
    told = f"Error:\N{NO-BREAK SPACE}{error.reworded(as_keys)}"
    told = textwrap.fill(told, line_width(), break_long_words=False, break_on_hyphens=False)
    print(told.replace("\N{NO-BREAK SPACE}", " ", 1), file=sys.stderr)


def show_failure(error: BaseException, status: Path, option: bool = False) -> None:
    """What failed in a line, and where the traceback is."""
    if traceback_wanted(option):
        traceback.print_exception(error, file=sys.stderr)
    first = (str(error).splitlines() or [""])[0]
    print(
        f"Failed: {type(error).__name__}: {first}\n"
        f"The traceback is in {status};\ndebug.traceback=true (or {TRACEBACK_VARIABLE}=1) shows it here as well.",
        file=sys.stderr,
    )
