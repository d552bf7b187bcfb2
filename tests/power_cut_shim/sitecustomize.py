"""Has every Python process of a run note what it brings to the disk and what it renames; see `power_cut`."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable


def _note(**event: object) -> None:
    descriptor = os.open(os.environ["POWER_CUT_LOG"], os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
    try:
        os.write(descriptor, (json.dumps(event) + "\n").encode())
    finally:
        os.close(descriptor)


def _noting_fsync(fsync: Callable[[int], None]) -> Callable[[int], None]:
    def noting(descriptor: int) -> None:
        fsync(descriptor)
        found = os.fstat(descriptor)
        if stat.S_ISDIR(found.st_mode):
            _note(kind="folder", inode=found.st_ino)
        else:
            _note(kind="file", inode=found.st_ino, size=found.st_size, written=found.st_mtime_ns)

    return noting


def _noting_rename(rename: Callable[..., None]) -> Callable[..., None]:
    def noting(source: str, target: str, **options: object) -> None:
        new = not os.path.lexists(target)
        # Noted first: a name that a kill leaves without a note would be taken for one on the disk.
        path = os.path.abspath(os.fspath(target))  # noqa: PTH100
        _note(kind="rename", path=path, new=new, folder=os.stat(os.path.dirname(path)).st_ino)  # noqa: PTH116, PTH120
        rename(source, target, **options)

    return noting


if "POWER_CUT_LOG" in os.environ:
    os.fsync = _noting_fsync(os.fsync)
    os.rename, os.replace = _noting_rename(os.rename), _noting_rename(os.replace)
