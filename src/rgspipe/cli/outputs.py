"""`python -m rgspipe outputs`: what the results take on the disk, and how to be rid of those that nobody needs."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path

from rgspipe.cli.runs import given_outputs
from rgspipe.datasets.input_file import input_folder
from rgspipe.errors import InputError
from rgspipe.retention import Choice, Stored, removable, remove, stored
from rgspipe.status import read_statuses

#: Seconds of what ages are written in.
UNITS = {"h": 3600, "d": 86400, "w": 7 * 86400}

#: What can be said beside the folder.
KEYS = ("outputs", "scene", "stage", "older", "remove")


def show_outputs(arguments: Sequence[str]) -> int:
    """List the results by scene and stage; with `prune`, list or remove those that nothing else needs.

    Args:
        arguments: prune, outputs=DIR, scene=NAME, stage=NAME, older=30d (or 12h, 4w), remove=true.

    Raises:
        InputError: an argument cannot be used, a manifest is damaged, or a run is going on that may need what goes.
    """
    prune = "prune" in arguments
    if not prune and "remove=true" in arguments:
        raise InputError("remove", expected="prune", found="a list", remedy="Say outputs prune remove=true.")
    values = _values([text for text in arguments if text not in ("list", "prune")])
    outputs = input_folder(given_outputs([f"outputs={values.get('outputs', 'outputs')}"]), "the folder of results")
    choice = Choice(values.get("scene"), values.get("stage"), _seconds(values["older"]) if "older" in values else None)
    everything = stored(outputs)
    if not prune:
        print(_table([one for one in everything if _is_listed(choice, one)], outputs))
        return 0
    return _prune(outputs, everything, choice, really=values.get("remove") == "true")


def _prune(outputs: Path, everything: Sequence[Stored], choice: Choice, really: bool) -> int:
    gone = removable(everything, choice)
    if really:
        _check_idle(outputs)
        gone = list(remove(outputs, gone))
    if not gone:
        print(f"Nothing to remove from {outputs}: what matches is needed by other results, or led to by a latest link.")
        return 0
    print(_table(gone, outputs))
    done = "Removed" if really else "Would be removed; say remove=true to do it:"
    print(f"{done} {len(gone)} of {len(everything)} folders, {_size(gone)} of {_size(everything)}.")
    return 0


def _check_idle(outputs: Path) -> None:
    """Refuse to take away what a run may be about to read."""
    for folder, status in read_statuses(outputs / "runs"):
        if status["state"] == "running":
            remedy = "Wait for it, or stop it; python -m rgspipe status shows it."
            raise InputError(folder, expected="no run going on in this folder", found="one", remedy=remedy)


def _values(arguments: Sequence[str]) -> dict[str, str]:
    for text in arguments:
        key, is_key, value = text.partition("=")
        if key not in KEYS or not is_key or (key == "remove" and value not in ("true", "false")):
            expected = "list, prune, outputs=DIR, scene=NAME, stage=NAME, older=30d or remove=true"
            raise InputError(repr(text), expected=expected, found="something else", remedy="Correct it.")
    return {text.partition("=")[0]: text.partition("=")[2] for text in arguments}


def _seconds(text: str) -> float:
    found = re.fullmatch(r"(\d{1,6})([hdw])", text)
    if found is None:
        raise InputError("older", expected="an age such as 12h, 30d or 4w", found=text, remedy="Correct it.")
    return float(found[1]) * UNITS[found[2]]


def _is_listed(choice: Choice, one: Stored) -> bool:
    """Whether a list has it; reports are listed like all else."""
    return Choice(choice.scene, one.key.stage if choice.stage is None else choice.stage, choice.older).takes(one)


def _table(shown: Sequence[Stored], outputs: Path) -> str:
    """A line for each scene and stage, the largest first within its scene."""
    groups: dict[tuple[str, str], list[Stored]] = {}
    for one in shown:
        groups.setdefault((one.key.scene, one.key.stage), []).append(one)
    sizes = sorted((names[0], -_bytes(group), names) for names, group in groups.items())
    rows = [_row(*names, groups[names]) for _, _, names in sizes]
    titles = ("scene", "stage", "folders", "size", "newest", "")
    widths = [max(len(row[column]) for row in [titles, *rows]) for column in range(len(titles))]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in [titles, *rows]]
    return "\n".join([*lines, f"{_size(shown)} in {outputs}"])


def _row(scene: str, stage: str, group: Sequence[Stored]) -> tuple[str, ...]:
    days = (time.time() - max(one.made for one in group)) / UNITS["d"]
    unfinished = sum(not one.whole for one in group)
    age = f"{days:.0f} days ago" if days >= 1.0 else "today"
    return scene, stage, str(len(group)), _size(group), age, f"{unfinished} unfinished" if unfinished else ""


def _bytes(group: Sequence[Stored]) -> int:
    return sum(one.bytes for one in group)


def _size(group: Sequence[Stored]) -> str:
    return f"{_bytes(group) / 1e6:.1f} MB"
