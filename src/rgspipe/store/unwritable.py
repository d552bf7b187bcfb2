"""A folder that cannot be written to, a full disk: told with the folder and what to do, wherever it shows."""

from __future__ import annotations

import contextlib
import os
import pwd
from collections.abc import Iterator
from pathlib import Path

from rgspipe.errors import InputError
from rgspipe.store.files import NO_ROOM, OCCUPIED, UNWRITABLE, told_number


@contextlib.contextmanager
def told_below(root: Path) -> Iterator[None]:
    """Have errors of the block that keep it from reading and writing below `root` raised as InputErrors.

    Raises:
        InputError: there is no room, or no right to read or write; names what could not be used.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        if (number := _number(error, root)) is None:
            raise
        named = error.filename if isinstance(error, OSError) else None
        raise refusal(str(root), root if named is None else Path(os.fsdecode(named)), number) from error


def refusal(where: str, path: Path, number: int) -> InputError:
    """What to say where `path` could not be read or written, with the system's number of the error."""
    if number in NO_ROOM:
        return InputError(
            where,
            expected="room on the disk",
            found=f"none for {path} ({os.strerror(number)})",
            remedy="Free some, or give a folder on another disk: outputs=FOLDER. "
            "What is done is kept, and the next run goes on from there.",
        )
    if number in OCCUPIED:
        return InputError(
            where,
            expected="folders of results, and nothing else by their names",
            found=f"{path}: {os.strerror(number)}",
            remedy="See what it is, and remove or rename it.",
        )
    return InputError(
        where,
        expected="a folder that can be read and written to",
        found=f"{path}: {os.strerror(number)}{_owner(path)}",
        remedy="Give a folder of yours, outputs=FOLDER, or have its owner let you in (chmod -R g+rwX).",
    )


def _number(error: Exception, root: Path) -> int | None:
    """The system's number of an error that concerns files below `root`; None for any other."""
    number = error.errno if isinstance(error, OSError) else told_number(error)
    if not isinstance(error, OSError) or error.filename is None:
        # Words of a library or of another process, and a stream that is written to, name no file.
        return number if number in NO_ROOM else None
    path = Path(os.fsdecode(error.filename)).absolute()
    return number if number in UNWRITABLE + OCCUPIED and path.is_relative_to(root.absolute()) else None


def _owner(path: Path) -> str:
    """Whose it is, or the folder above it that can be seen, if not the user's own."""
    for place in (path, *path.parents):
        with contextlib.suppress(OSError):
            user = place.stat().st_uid
            return "" if user == os.geteuid() else f" ({place} belongs to {_name(user)})"
    return ""


def _name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:  # one that this machine does not know
        return f"the user {user}"
