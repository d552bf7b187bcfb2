"""`python -m rgspipe status`: how the runs and sweep jobs ended."""

from __future__ import annotations

import difflib
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rgspipe.cli.arguments import meant, refused
from rgspipe.cli.help import groups, sections
from rgspipe.cli.messages import line_width
from rgspipe.datasets.input_file import folder_to_be
from rgspipe.errors import InputError, printable
from rgspipe.program import typed
from rgspipe.store.status import STATES, read_statuses

#: What runs are told apart by beside what they were started with.
_KEYS = ("state", "stage", "outputs")

#: Where names and reasons begin in the list, and the lines of each at most; `status RUN` has all of it.
REASON, MOST_LINES = 18, 3


def show_runs(arguments: Sequence[str]) -> int:
    """Print a line for each run below outputs/runs (or `outputs=DIR`), and why it failed; all of one that is named.

    Args:
        arguments: outputs=DIR, state=STATE, any override that runs were started with, such as stage=fit_light, or the
            name of a run.

    Raises:
        InputError: there is no such run, no such state, or no such key.
    """
    outputs = _given_outputs(arguments)
    wanted = [text for text in arguments if not text.startswith("outputs=")]
    names = [text for text in wanted if "=" not in text]
    runs = [(str(folder.relative_to(outputs / "runs")), status) for folder, status in read_statuses(outputs / "runs")]
    if unknown := [name for name in names if name not in dict(runs)]:
        near = difflib.get_close_matches(unknown[0], [name for name, _ in runs], n=1, cutoff=0.3)
        remedy = f"Did you mean {near[0]}?" if near else f"{typed('status')} lists them."
        raise InputError(unknown[0], expected=f"the name of a run in {outputs / 'runs'}", found="none", remedy=remedy)
    asked = [text for text in wanted if "=" in text]
    _check_keys(asked, [status for _, status in runs])
    chosen = [(name, status) for name, status in runs if not names or name in names]
    chosen = [(name, status) for name, status in chosen if all(_has(status, text) for text in asked)]
    for name, status in chosen:
        told = [*_head(name, status), *(_details(status) if names else _reason(status))]
        # Whoever may write to the folder may have put there what would steer a terminal.
        print("\n".join(printable(line) for text in told for line in text.splitlines()))
    if not chosen:
        print(f"No {'such ' if runs else ''}runs in {outputs / 'runs'}.")
    return 0


def _check_keys(asked: Sequence[str], statuses: Sequence[Mapping[str, Any]]) -> None:
    """Refuse keys that no run can have been started with, and states that no run can be in: they are misspelt."""
    states = {*STATES, *(status["state"] for status in statuses)}
    used = [text.partition("=")[0].lstrip("+~") for status in statuses for text in status["overrides"]]
    known = {*_KEYS, *used, *groups(), *(setting.key for settings in sections().values() for setting in settings)}
    for text in asked:
        key, _, value = text.partition("=")
        if key == "state" and value not in states:
            raise refused(text, f"one of {', '.join(STATES)}", "status")
        if key.lstrip("+~") not in known:
            remedy = meant(text, [f"{name}=" for name in (*_KEYS, *known)]) or "rgspipe --help status says more."
            raise InputError(key, expected="a key that runs are started with, or state", found="none", remedy=remedy)


def _has(status: Mapping[str, Any], wanted: str) -> bool:
    """Whether a run stands as `state=` says, or was started with an override."""
    return wanted in (f"state={status['state']}", f"stage={status['stage']}", *status["overrides"])


def _head(name: str, status: Mapping[str, Any]) -> list[str]:
    """How it ended, its name and what it was started with, in few lines."""
    seconds = f"{status['seconds']:.0f} s" if "seconds" in status else ""
    first, *more = _wrapped(f"{name}  {' '.join(status['overrides'])}")
    return [f"{status['state']:<8} {seconds:>7}  {first.strip()}", *more]


def _reason(status: Mapping[str, Any]) -> list[str]:
    """Why it failed, in few lines."""
    lines = str(status.get("error", "")).splitlines()
    if not lines or status["state"] == "stopped":
        return []
    return _wrapped(lines[0])


def _wrapped(text: str) -> list[str]:
    """The beginning of a text, in lines that fit the terminal."""
    room = line_width() - REASON
    told = textwrap.wrap(text, room, max_lines=MOST_LINES, placeholder=" …", break_on_hyphens=False)
    return [f"{'':{REASON}}{line}" for line in told]


def _details(status: Mapping[str, Any]) -> list[str]:
    """All that is known of one run."""
    shown = {"command": "command", "started": "started", "ended": "ended", "result": "result", "error": "error"}
    return [f"  {word:<8} {status[key]}" for key, word in shown.items() if status.get(key)]


def given_outputs(arguments: Sequence[str], command: str) -> Path:
    """The folder of results that a command names which takes nothing else, or the usual one.

    Raises:
        InputError: it names something else.
    """
    for text in arguments:
        if not text.startswith("outputs="):
            raise refused(text, "outputs=DIR", command)
    return _given_outputs(arguments)


def _given_outputs(arguments: Sequence[str]) -> Path:
    given = [text.partition("=")[2] for text in arguments if text.startswith("outputs=")]
    return folder_to_be(given[-1] if given else "outputs", "the folder of results")
