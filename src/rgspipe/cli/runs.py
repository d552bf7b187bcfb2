"""`python -m rgspipe status`: how the runs and sweep jobs ended."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rgspipe.errors import InputError
from rgspipe.store.status import read_statuses

#: Characters of a reason in the list.
REASON = 120


def show_runs(arguments: Sequence[str]) -> int:
    """Print a line for each run below outputs/runs (or `outputs=DIR`), and why it failed; all of one that is named.

    Args:
        arguments: outputs=DIR, state=STATE, any override that runs were started with, such as stage=fit_light, or the
            name of a run.
    """
    outputs = given_outputs([text for text in arguments if text.startswith("outputs=")])
    wanted = [text for text in arguments if not text.startswith("outputs=")]
    names = [text for text in wanted if "=" not in text]
    runs = [(str(folder.relative_to(outputs / "runs")), status) for folder, status in read_statuses(outputs / "runs")]
    if unknown := [name for name in names if name not in dict(runs)]:
        near = difflib.get_close_matches(unknown[0], [name for name, _ in runs], n=1, cutoff=0.3)
        remedy = f"Did you mean {near[0]}?" if near else "python -m rgspipe status lists them."
        raise InputError(unknown[0], expected=f"the name of a run in {outputs / 'runs'}", found="none", remedy=remedy)
    chosen = [(name, status) for name, status in runs if not names or name in names]
    chosen = [(name, status) for name, status in chosen if all(_has(status, text) for text in wanted if "=" in text)]
    for name, status in chosen:
        print("\n".join([_line(name, status), *(_details(status) if names else _reason(status))]))
    if not chosen:
        print(f"No {'such ' if runs else ''}runs in {outputs / 'runs'}.")
    return 0


def _has(status: Mapping[str, Any], wanted: str) -> bool:
    """Whether a run stands as `state=` says, or was started with an override."""
    return wanted in (f"state={status['state']}", f"stage={status['stage']}", *status["overrides"])


def _line(name: str, status: Mapping[str, Any]) -> str:
    seconds = f"{status['seconds']:.0f} s" if "seconds" in status else ""
    return f"{status['state']:<8} {seconds:>7}  {name}  {' '.join(status['overrides'])}"


def _reason(status: Mapping[str, Any]) -> list[str]:
    """Why it failed, in a line."""
    lines = str(status.get("error", "")).splitlines()
    return [f"{'':18}{lines[0][:REASON]}"] if lines and status["state"] != "stopped" else []


def _details(status: Mapping[str, Any]) -> list[str]:
    """All that is known of one run."""
    shown = {"command": "command", "started": "started", "ended": "ended", "result": "result", "error": "error"}
    return [f"  {word:<8} {status[key]}" for key, word in shown.items() if status.get(key)]


def given_outputs(arguments: Sequence[str]) -> Path:
    """The folder of results that a command about what is there already names, or the usual one.

    Raises:
        InputError: it names something else.
    """
    outputs = Path("outputs")
    for text in arguments:
        if not text.startswith("outputs="):
            raise InputError(repr(text), expected="outputs=DIR", found="something else", remedy="Leave it away.")
        outputs = Path(text.partition("=")[2])
    return outputs
