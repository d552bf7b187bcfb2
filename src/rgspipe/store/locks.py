"""The lock under which an artifact is made or removed: the system's, so it ends with its holder however that ends."""

from __future__ import annotations

import contextlib
import fcntl
import logging
import os
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from rgspipe.store.files import NO_ROOM, make_folder

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


def locked_to_remove(folder: Path, name: str) -> contextlib.AbstractContextManager[object]:
    """`locked_if_free`, also on a disk that has no room for the file that is locked: what is removed makes some.

    Where that file is not there nobody holds it, and nobody else finds room for it either.

    Raises:
        filelock.Timeout: another process holds it.
    """
    try:
        return locked_if_free(folder, name)
    except OSError as error:
        if error.errno in NO_ROOM and not lock_file(folder, name).exists():
            return contextlib.nullcontext()
        raise


@contextlib.contextmanager
def folder_locked_if_free(folder: Path) -> Iterator[None]:
    """A lock on a folder itself, which needs no file and no room; nothing where the file system has none of folders.

    Raises:
        filelock.Timeout: another process holds it.
    """
    number = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise Timeout(str(folder)) from None
        except OSError:  # NFS locks only what can be written to, and a folder cannot
            pass
        yield
    finally:
        os.close(number)


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
