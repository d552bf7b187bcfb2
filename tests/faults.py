"""What befalls a run at one of the calls by which it publishes: fsync, rename, a link, a folder, a removal.

All calls of a run are counted, and noted for `power_cut`, also those of Python processes that it starts.
"""

from __future__ import annotations

import errno
import json
import os
import signal
import stat
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

#: What hands a fault on to processes that are started.
VARIABLE = "FAULT"

#: Where these find the code that does.
PATHS = (str(Path(__file__).resolve().parent / "fault_shim"), str(Path(__file__).resolve().parent))

#: Calls by which something gets or loses a name, or is brought to the disk.
CALLS = ("fsync", "rename", "replace", "symlink", "link", "mkdir", "unlink", "remove", "rmdir")

#: Those whose second argument is the name that is given.
NAMING = ("rename", "replace", "symlink", "link")


@dataclass(frozen=True)
class Fault:
    """What happens to a run, and at which of its calls.

    Attributes:
        log: where its calls are noted, a JSON object a line.
        kept: a folder on the disk of the run, in which what is replaced stays at hand.
        kind: "before" or "after": it is killed before or after the call, with all that it has started; "refused": there
            is no room for what the call does. Nothing happens by default.
        at: the number of the call, from 1.
    """

    log: str
    kept: str
    kind: str = ""
    at: int = 0

    @classmethod
    def of(cls, environment: Mapping[str, str]) -> Fault:
        """The one that was handed on."""
        return cls(**json.loads(environment[VARIABLE]))

    def environment(self, given: Mapping[str, str] = os.environ) -> dict[str, str]:
        """The environment that hands it on."""
        paths = [*PATHS, *filter(None, [given.get("PYTHONPATH")])]
        return {**given, "PYTHONPATH": os.pathsep.join(paths), VARIABLE: json.dumps(asdict(self))}


def install(fault: Fault) -> None:
    """Have this process suffer a fault."""
    for name in CALLS:
        setattr(os, name, _suffering(name, getattr(os, name), fault))


def _suffering(name: str, call: Callable[..., None], fault: Fault) -> Callable[..., None]:
    def suffering(*arguments: object, **options: object) -> None:
        number = _next(fault)
        kind = fault.kind if number == fault.at else ""
        if kind:
            _append(f"{fault.log}.hit", f"{name} {_what(name, arguments)}".encode())
        if kind == "before":
            os.killpg(0, signal.SIGKILL)
        if kind == "refused":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), *([] if name == "fsync" else arguments[:1]))
        if "dir_fd" not in options:
            _note_name(fault, name, arguments, number)
        try:
            call(*arguments, **options)
            if name == "fsync":
                _note_synced(fault.log, os.fstat(int(str(arguments[0]))))
        finally:
            if kind == "after":
                os.killpg(0, signal.SIGKILL)

    return suffering


def _what(name: str, arguments: tuple[object, ...]) -> str:
    """What a call is about: "rename manifest.json"."""
    if name == "fsync":
        return Path(f"/proc/self/fd/{arguments[0]}").readlink().name
    return Path(str(arguments[1 if name in NAMING else 0])).name


def _note_name(fault: Fault, name: str, arguments: tuple[object, ...], number: int) -> None:
    """Note which name is about to be given, and keep what has it, before a kill can leave it without a note."""
    if name in NAMING:
        path = Path(str(arguments[1])).absolute()
    elif name == "mkdir":
        path = Path(str(arguments[0])).absolute()
    else:
        return
    former = ""
    if os.path.lexists(path) and not (path.is_dir() and not path.is_symlink()):
        former = f"{fault.kept}/{os.getpid()}_{number}"
        _LINK(path, former, follow_symlinks=False)
    new = not former and not os.path.lexists(path)
    _note(fault.log, kind="name", path=str(path), new=new, former=former, folder=path.parent.stat().st_ino)


def note_settled(log: str, files: Iterable[Path]) -> None:
    """Note that files are on the disk."""
    for path in files:
        _note_synced(log, path.stat())


def _note_synced(log: str, found: os.stat_result) -> None:
    if stat.S_ISDIR(found.st_mode):
        _note(log, kind="folder", inode=found.st_ino)
    else:
        _note(log, kind="file", inode=found.st_ino, size=found.st_size, written=found.st_mtime_ns)


def _next(fault: Fault) -> int:
    """The number of a call among those of all processes of a run: how many bytes a file has, one for each."""
    return _append(f"{fault.log}.count", b".")


def _note(log: str, **event: object) -> None:
    _append(log, (json.dumps(event) + "\n").encode())


def _append(path: str, content: bytes) -> int:
    """Add to the end of a file; where its end is then."""
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
    try:
        os.write(descriptor, content)
        return os.lseek(descriptor, 0, os.SEEK_CUR)
    finally:
        os.close(descriptor)


_LINK = os.link
