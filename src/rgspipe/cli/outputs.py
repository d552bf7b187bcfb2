"""`python -m rgspipe outputs`: what the results take on the disk, and how to be rid of those that nobody needs."""

from __future__ import annotations

import contextlib
import difflib
import re
import time
from collections.abc import Sequence
from pathlib import Path

from rgspipe.arguments import as_path
from rgspipe.cli.arguments import refused
from rgspipe.cli.columns import columns, without_empty
from rgspipe.datasets.input_file import input_folder
from rgspipe.errors import InputError
from rgspipe.program import typed
from rgspipe.store.retention import Choice, Stored, in_the_making, removable, remove, removing, stored
from rgspipe.store.status import read_statuses

#: Seconds of what ages are written in.
UNITS = {"h": 3600, "d": 86400, "w": 7 * 86400}

#: What can be said beside the folder.
KEYS = ("outputs", "scene", "stage", "older", "remove")


def show_outputs(arguments: Sequence[str]) -> int:
    """List the results by scene and stage, those of a stage that is named one by one; with `prune`, list or remove
    those that nothing else needs.

    Args:
        arguments: list or prune, outputs=DIR, scene=NAME, stage=NAME, older=30d (or 12h, 4w), remove=true.

    Raises:
        InputError: an argument cannot be used, a manifest is damaged, or a run is going on that may need what goes.
    """
    words = [text.removeprefix("--") for text in arguments]
    prune = "prune" in words
    if not prune and "remove=true" in words:
        raise InputError("remove", expected="prune", found="a list", remedy="Say outputs prune remove=true.")
    values = _values([text for text in words if text not in ("list", "prune")])
    outputs = as_path(values.get("outputs", "outputs"), "outputs")
    if "outputs" not in values and not outputs.exists():
        print(f"No results in {outputs}.")
        return 0
    input_folder(outputs, "the folder of results")
    choice = Choice(values.get("scene"), values.get("stage"), _seconds(values["older"]) if "older" in values else None)
    if values.get("remove") != "true":
        return _show(outputs, choice, prune)
    with removing(outputs):
        list(remove(outputs, []))  # what a removal that was killed has left
        return _show(outputs, choice, prune, really=True)


def _show(outputs: Path, choice: Choice, prune: bool, really: bool = False) -> int:
    everything = stored(outputs)
    _check_names(choice, everything)
    if prune:
        return _prune(outputs, everything, choice, really)
    shown = [one for one in everything if _is_listed(choice, one)]
    if not shown:
        print(f"No {'such ' if everything else ''}results in {outputs}.")
        return 0
    _print(shown, outputs, singly=choice.stage is not None)
    return 0


def _prune(outputs: Path, everything: Sequence[Stored], choice: Choice, really: bool) -> int:
    gone, busy = removable(everything, choice), _busy(outputs, really)
    if really:
        if busy is not None:
            raise busy
        gone = list(remove(outputs, gone))
    if not gone:
        print(f"Nothing to remove from {outputs}: what matches is needed by other results, or led to by a latest link.")
        return 0
    _print(gone, outputs, singly=True)
    done = "Removed" if really else "Would be removed; say remove=true to do it:"
    print(f"{done} {len(gone)} of {len(everything)} folders, {_size(gone)} of {_size(everything)}.")
    if busy is not None:
        print(f"That is refused for now: {busy}")
    return 0


def _busy(outputs: Path, removes: bool) -> InputError | None:
    """Why nothing may be taken away: a run may be about to read it, or another removal is going on.

    Args:
        removes: whether who asks is the one that is.
    """
    try:
        with contextlib.nullcontext() if removes else removing(outputs):
            pass
    except InputError as error:
        return error
    remedy = f"Wait for it, or stop it; {typed('status')} shows it."
    for folder, status in read_statuses(outputs / "runs"):
        if status["state"] == "running":
            return InputError(folder, expected="no run going on in this folder", found="one", remedy=remedy)
    # A run may keep its status elsewhere (hydra.run.dir), and Python none.
    if (folder := in_the_making(outputs)) is not None:
        expected, found = "no result in the making in this folder", "a process that makes it"
        return InputError(folder, expected=expected, found=found, remedy=remedy)
    return None


def _check_names(choice: Choice, everything: Sequence[Stored]) -> None:
    """Refuse scenes and stages of which there is nothing: they are misspelt."""
    for key, name, there in (
        ("scene", choice.scene, {one.key.scene for one in everything}),
        ("stage", choice.stage, {one.key.stage for one in everything}),
    ):
        if name is not None and there and name not in there:
            near = difflib.get_close_matches(name, there, n=1)
            remedy = f"Did you mean {key}={near[0]}?" if near else "Choose one of them."
            raise InputError(key, expected=f"one of {', '.join(sorted(there))}", found=repr(name), remedy=remedy)


def _values(arguments: Sequence[str]) -> dict[str, str]:
    for text in arguments:
        key, is_key, value = text.partition("=")
        if key not in KEYS or not is_key or (key == "remove" and value not in ("true", "false")):
            expected = "list, prune, outputs=DIR, scene=NAME, stage=NAME, older=30d or remove=true"
            raise refused(text, expected, "outputs")
    return {text.partition("=")[0]: text.partition("=")[2] for text in arguments}


def _seconds(text: str) -> float:
    found = re.fullmatch(r"(\d{1,6})([hdw])", text)
    if found is None:
        raise InputError("older", expected="an age such as 12h, 30d or 4w", found=text, remedy="Correct it.")
    return float(found[1]) * UNITS[found[2]]


def _is_listed(choice: Choice, one: Stored) -> bool:
    """Whether a list has it; reports are listed like all else."""
    return Choice(choice.scene, one.key.stage if choice.stage is None else choice.stage, choice.older).takes(one)


def _print(shown: Sequence[Stored], outputs: Path, singly: bool) -> None:
    """A line for each scene and stage, or for each folder; the largest first within its scene, or stage."""
    if singly:
        found = sorted(shown, key=lambda one: (one.key.scene, one.key.stage, -one.bytes))
        rows = [["folder", "size", "made", ""], *map(_single, found)]
    else:
        groups: dict[tuple[str, str], list[Stored]] = {}
        for one in shown:
            groups.setdefault((one.key.scene, one.key.stage), []).append(one)
        sizes = sorted((names[0], -_bytes(group), names) for names, group in groups.items())
        titles = ["scene", "stage", "folders", "size", "newest", ""]
        rows = [titles, *(_row(*names, groups[names]) for _, _, names in sizes)]
    print("\n".join([*columns(without_empty(rows)), f"{_size(shown)} in {outputs}"]))


def _row(scene: str, stage: str, group: Sequence[Stored]) -> list[str]:
    unfinished = sum(not one.whole for one in group)
    words = f"{unfinished} unfinished" if unfinished else ""
    return [scene, stage, str(len(group)), _size(group), _age(max(one.made for one in group)), words]


def _single(one: Stored) -> list[str]:
    words = ("latest" if one.linked else "") if one.whole else "unfinished"
    return [f"{one.key.scene}/{one.key.stage}/{one.folder.name}", _size([one]), _age(one.made), words]


def _age(made: float) -> str:
    """How long ago, in the units that `older=` takes."""
    hours = max(0.0, time.time() - made) / UNITS["h"]
    if hours < 1.0:
        return "under 1h ago"
    return f"{hours:.0f}h ago" if hours < 48.0 else f"{hours / 24.0:.0f}d ago"


def _bytes(group: Sequence[Stored]) -> int:
    return sum(one.bytes for one in group)


def _size(group: Sequence[Stored]) -> str:
    return f"{_bytes(group) / 1e6:.1f} MB"
