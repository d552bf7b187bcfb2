"""The lock under which an artifact is made or removed: the system's, so it ends with its holder however that ends."""

from __future__ import annotations

import contextlib
import logging
import os
from pathlib import Path

from filelock import FileLock, Timeout

from rgspipe.store.files import make_folder

#: What the file that is locked is called, before the name of the artifact.
LOCK = ".lock-"

log = logging.getLogger(__name__)


def lock_file(folder: Path, name: str) -> Path:
    """The file that is locked for the artifact `name` of a folder."""
    return folder / f"{LOCK}{name}"


def locked_if_free(folder: Path, name: str) -> FileLock:
    """A lock that is held until its block ends; the folder is made where it is not there.

    Raises:
        filelock.Timeout: another process holds it.
    """
    file = lock_file(folder, name)
    while True:
        make_folder(folder)
        # Another process may remove the folder at this moment, as what it wanted to make in it was refused.
        with contextlib.suppress(FileNotFoundError):
            # The umask says who else may hold it: whoever may write to the folder of a group must be able to.
            os.close(os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666))
            break
    return FileLock(file).acquire(timeout=0)


def locked(folder: Path, name: str) -> FileLock:
    """`locked_if_free`, but waits for the process that holds it, and says so."""
    try:
        return locked_if_free(folder, name)
    except Timeout:
        log.info("%s: another process is making %s; waiting for it", folder.name, name)
    while True:
        with contextlib.suppress(FileNotFoundError):  # what was to be made was refused, and its folder removed
            return FileLock(lock_file(folder, name)).acquire()
        make_folder(folder)
