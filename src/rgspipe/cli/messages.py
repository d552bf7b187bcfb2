"""What people read when something goes wrong."""

from __future__ import annotations

import os
import sys
import textwrap
import traceback
from pathlib import Path

from rgspipe.errors import InputError

#: Exit status of a run that failed, of one whose input cannot be used, of one that was stopped with Ctrl-C, and of one
#: whose output nobody reads any more.
EXIT_FAILED, EXIT_INPUT, EXIT_INTERRUPTED, EXIT_UNREAD = 1, 2, 130, 141

TRACEBACK_VARIABLE = "RGSPIPE_TRACEBACK"


def traceback_wanted(option: bool = False) -> bool:
    """Whether tracebacks go to the terminal: `debug.traceback=true` or RGSPIPE_TRACEBACK=1."""
    return option or os.environ.get(TRACEBACK_VARIABLE, "") not in ("", "0")


def show_input_error(error: InputError, option: bool = False) -> None:
    """One paragraph on stderr; the traceback before it only if asked for."""
    if traceback_wanted(option):
        traceback.print_exception(error, file=sys.stderr)
    print(textwrap.fill(f"Error: {error}", 110, break_long_words=False, break_on_hyphens=False), file=sys.stderr)


def show_failure(error: BaseException, status: Path, option: bool = False) -> None:
    """What failed in a line, and where the traceback is."""
    if traceback_wanted(option):
        traceback.print_exception(error, file=sys.stderr)
    first = (str(error).splitlines() or [""])[0]
    print(
        f"Failed: {type(error).__name__}: {first}\n"
        f"The traceback is in {status}; debug.traceback=true (or {TRACEBACK_VARIABLE}=1) shows it here as well.",
        file=sys.stderr,
    )
