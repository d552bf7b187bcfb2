"""The folder in which an artifact is made, from when it is begun until it is published or given up."""

from __future__ import annotations

import contextlib
from pathlib import Path

from rgspipe.errors import InputError
from rgspipe.store.files import remove_any, remove_tree

#: What it is called, before the name of the artifact.
PARTIAL = ".partial-"


def begin(partial: Path) -> bool:
    """Make the folder, or find what an interrupted run left in it; whether it was there.

    Raises:
        InputError: something else has its name; a link is not followed.
    """
    if partial.is_symlink() or (partial.exists() and not partial.is_dir()):
        raise InputError(partial, expected="a folder, or nothing", found="something else", remedy="Remove it.")
    there = partial.exists()
    partial.mkdir(exist_ok=True)
    return there


def forget(partial: Path, lock: Path) -> None:
    """Leave no trace of what was refused before anything was made of it, nor empty folders; its lock is held."""
    if any(path.is_file() for path in partial.rglob("*")):
        return
    remove_tree(partial)
    # Who waits for the lock sees that its file is gone, and takes a new one.
    lock.unlink()
    for folder in (partial.parent, partial.parent.parent):  # of its stage, and of its scene
        with contextlib.suppress(OSError):  # something is in it, or was never ours
            folder.rmdir()


def remove_scratch(partial: Path) -> None:
    """Remove what is not published: names that begin with a dot."""
    for path in list(partial.rglob(".*")):
        remove_any(path)
