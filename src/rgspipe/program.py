"""This program as it was started, and commands as they can be typed again."""

from __future__ import annotations

import shlex
import shutil
import sys
from pathlib import Path

#: What the program is called where it was not started as one: from a notebook, or by a test.
USUAL = ("python", "-m", "rgspipe")


def program() -> tuple[str, ...]:
    """What was typed to start this process, up to its arguments."""
    # Hydra and worker processes change sys.argv.
    words = sys.orig_argv
    if words[1:3] == ["-m", "rgspipe"]:
        return tuple(words[:3])
    script = Path(words[1]) if len(words) > 1 else Path()
    if script.name != "rgspipe":
        return USUAL
    # Of a script that was found by its name alone, the system tells the whole path.
    found = shutil.which(script.name)
    return (script.name,) if found is not None and Path(found).samefile(script) else (str(script),)


def typed(*words: str) -> str:
    """This program with arguments, quoted for a shell."""
    return shlex.join([*program(), *words])
