"""A power cut: what a run had not brought to the disk may be gone, and so may names that were not."""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from faults import note_settled

Event = Mapping[str, object]


def cut_power(root: Path, log: Path, chance: random.Random | None = None) -> list[Path]:
    """Lose what the log does not know to be on the disk: names that were given, and the content of files; the paths.

    Args:
        root: what lies below it.
        log: what `faults` has noted of the runs that wrote there.
        chance: decides how many of the names, which are lost from the last one on, and which contents; all by default.
    """
    events = [json.loads(line) for line in log.read_text().splitlines()] if log.is_file() else []
    lost = _take_names(root, _unsettled(events), chance)
    kept = {(event["inode"], event["size"], event["written"]) for event in events if event["kind"] == "file"}
    for path in sorted(path for path in root.rglob("*") if path.is_file() and not path.is_symlink()):
        found = path.stat()
        settled = not found.st_size or (found.st_ino, found.st_size, found.st_mtime_ns) in kept
        if not settled and (chance is None or chance.random() < 0.5):
            path.write_bytes(b"")
            lost.append(path)
    # Whatever is left is on the disk: the next cut takes none of it.
    log.write_bytes(b"")
    note_settled(str(log), (path for path in root.rglob("*") if path.is_file() and not path.is_symlink()))
    return lost


def _unsettled(events: Sequence[Event]) -> list[Event]:
    """The names whose folder was not brought to the disk after they were given."""
    last = {event["inode"]: number for number, event in enumerate(events) if event["kind"] == "folder"}
    return [
        event
        for number, event in enumerate(events)
        if event["kind"] == "name" and last.get(event["folder"], -1) < number
    ]


def _take_names(root: Path, given: Sequence[Event], chance: random.Random | None) -> list[Path]:
    """Take names back, the last one first: to nothing, or to what had them before."""
    lost = []
    for event in reversed(given[0 if chance is None else chance.randint(0, len(given)) :]):
        path = Path(str(event["path"]))
        if not path.is_relative_to(root) or not path.parent.is_dir():
            continue
        if event["former"]:
            os.replace(str(event["former"]), path)  # noqa: PTH105
            lost.append(path)
        elif event["new"] and os.path.lexists(path):
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
            lost.append(path)
    return lost
