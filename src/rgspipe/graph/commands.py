"""Commands of this program as they can be typed again."""

from __future__ import annotations

import shlex
import shutil
import sys
from collections.abc import Mapping, Sequence
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


def command(
    stage: str, overrides: Sequence[str], changes: Mapping[str, object] | None = None, sweep: bool = False
) -> str:
    """The command that runs a stage as another run was started, quoted for a shell.

    Args:
        overrides: of the other run; its stage, and whether it may make what is missing, are not taken over.
        changes: values by key that take the place of theirs.
        sweep: whether the overrides are those of a sweep, of which the command is one, too.
    """
    changes = changes or {}
    own = {"stage", "upstream", *changes}
    kept = [text for text in overrides if text.split("=")[0].lstrip("+~") not in own]
    changed = [f"{key}={as_override(value)}" for key, value in changes.items()]
    return typed(*(["-m"] if sweep else []), f"stage={stage}", *kept, *changed)


def typed(*words: str) -> str:
    """This program with arguments, quoted for a shell."""
    return shlex.join([*program(), *words])


def as_override(value: object) -> str:
    """A value as the command line has it."""
    if value is None:
        return "null"
    if isinstance(value, list | tuple):
        return f"[{','.join(map(as_override, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)
