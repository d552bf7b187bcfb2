"""The commands of stages as they can be typed again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rgspipe.plain_values import as_shown
from rgspipe.program import typed


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
    return typed(*(["-m"] if sweep else []), f"stage={stage}", *map(as_shown, [*kept, *changed]))


def as_override(value: object) -> str:
    """A value as the command line has it."""
    if value is None:
        return "null"
    if isinstance(value, list | tuple):
        return f"[{','.join(map(as_override, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)
