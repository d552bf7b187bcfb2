"""Files that are whole or not there, also after a power cut: the one way in which they are written, and checksums."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import itertools
import json
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rgspipe.errors import InputError

#: Why a file cannot be written though nothing is wrong with what it holds: no room, or no right to.
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
NO_RIGHT = (errno.EROFS, errno.EACCES, errno.EPERM)
UNWRITABLE = NO_ROOM + NO_RIGHT

#: Why a file, folder or link cannot be made where there is room and the right to: something else has its name.
OCCUPIED = (errno.EISDIR, errno.ENOTDIR, errno.ENOTEMPTY, errno.EEXIST, errno.ELOOP)

#: Characters of a file's name that the one it is written under repeats: names may have NAME_BYTES.
LONGEST_STEM = 40

#: Bytes of a name, and of a path, that file systems take.
NAME_BYTES, PATH_BYTES = 255, 4096

#: The longest name of a file or folder that is read or stands in a list, bytes: one in the making is longer.
LONGEST_NAME = 200

#: What a folder's name begins with while it is removed, so that nobody takes it for what it was.
GONE = ".gone-"

#: What the name of a damaged artifact begins with that was set aside; a number follows.
ASIDE = ".damaged-"

#: What the name of a link ends with while it is made.
UNFINISHED = ".new"


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """An empty file beside `path`, which takes its name once the block has written it.

    So `path` holds either its former content or all of the new one, even after a power cut, and nobody sees half of
    it. The folder is made where it is not there. The file that is written to has the suffix of `path` and a name that
    nobody can foresee; who may read it is what the umask says.

    Raises:
        InputError: its name is too long.
        OSError: the file cannot be written; names it.
    """
    path = Path(path)
    _check_name(path)
    make_folder(path.parent)
    temporary = path.with_name(f".{path.stem[:LONGEST_STEM]}.{secrets.token_hex(8)}{path.suffix}")
    try:
        permissions = _create(temporary)
        try:
            yield temporary
            _settle(temporary, permissions)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
        sync(path.parent)
    except Exception as error:
        if (number := _write_error(error, temporary)) is None:
            raise
        raise OSError(number, os.strerror(number), str(path)) from error


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write `content` as `replacing` does."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write `text` in UTF-8 as `replacing` does."""
    write_bytes(path, text.encode())


def write_json(path: str | Path, value: Any) -> None:
    """`write_text` of indented JSON.

    Raises:
        ValueError: there is a NaN or an infinity, which JSON does not know.
    """
    write_text(path, json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def append_line(path: Path, line: str) -> None:
    """Add a line at the end of a file and bring it to the disk; one that was cut off before stays a line of its own."""
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW
    descriptor = os.open(path, flags, 0o666)
    try:
        os.write(descriptor, f"\n{line}".encode())
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    sync(path.parent)


def point_at(link: Path, target: str) -> None:
    """Make the symbolic link `link` point at `target` (relative to its folder), in one step, also after a power cut.

    What a kill leaves beside it, the next call removes, and so may anybody at any time (`unfinished_links`): links are
    followed by nobody while they are made, so that one name for all who make them will do.
    """
    temporary = link.with_name(f".{link.name}{UNFINISHED}")
    while True:
        temporary.unlink(missing_ok=True)
        try:
            temporary.symlink_to(target)
            temporary.replace(link)
        except (FileExistsError, FileNotFoundError):  # another process makes the link at this moment
            if not link.parent.is_dir():
                raise
        except OSError as error:  # which names what the link was to lead to
            temporary.unlink(missing_ok=True)
            raise OSError(error.errno, error.strerror, str(link)) from error
        else:
            break
    sync(link.parent)


def unfinished_links(folder: Path, name: str) -> Iterator[Path]:
    """What kills have left of links whose names begin with `name`; what is being made at this moment is among it."""
    return (path for path in folder.glob(f".{name}*{UNFINISHED}") if path.is_symlink())


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, where they are not there, so that they outlast a power cut.

    Raises:
        InputError: its name is too long.
    """
    _check_name(folder)
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for place in missing:
        sync(place.parent)


def remove_tree(folder: Path) -> None:
    """Remove a folder with all that is in it, if it is there.

    Raises:
        OSError: something cannot be removed; names the folder, where the library has a name without one.
    """
    try:
        shutil.rmtree(folder)
    except FileNotFoundError:  # gone, or another process removes it at this moment
        if folder.exists():
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(folder)) from error


def remove_at_once(folder: Path) -> None:
    """Remove a folder in one step, then take it apart: a kill leaves it whole or gone.

    What is left of it is called `.gone-` and its name.
    """
    away = folder.with_name(GONE + folder.name)
    remove_any(away)
    folder.rename(away)
    sync(away.parent)
    remove_any(away)


def set_aside(path: Path) -> Path:
    """Give what lies somewhere a name by which nobody takes it for what it was; its new place."""
    number = itertools.count(1)
    while os.path.lexists(away := path.with_name(f"{ASIDE}{next(number)}-{path.name}")):
        pass
    path.rename(away)
    sync(away.parent)
    return away


def remove_any(path: Path) -> None:
    """Remove what has a name, if anything has: a folder with all that is in it, a link but not what it leads to."""
    if path.is_dir() and not path.is_symlink():
        remove_tree(path)
    else:
        path.unlink(missing_ok=True)


def publish(partial: Path, folder: Path) -> None:
    """Bring a folder with all that is in it to the disk, then rename it: `folder` is whole or not there."""
    sync_tree(partial)
    partial.rename(folder)
    sync(folder.parent)


def sync_tree(folder: Path) -> None:
    """Bring every file and folder below `folder`, and itself, to the disk."""
    for path in [*folder.rglob("*"), folder]:
        if not path.is_symlink():
            sync(path)


def sync(path: Path) -> None:
    """Bring one file's content, or one folder's list of names, to the disk."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        # A folder that may be written to but not listed, or a network file system that keeps names in its own way.
        if error.errno not in (errno.EACCES, errno.EINVAL) or not path.is_dir():
            raise


def _check_name(path: Path) -> None:
    """Refuse a name that no file system takes, before anything is made on its way."""
    longest = max((len(os.fsencode(part)) for part in path.parts), default=0)
    if longest > NAME_BYTES or len(os.fsencode(path)) >= PATH_BYTES:
        found = f"one of {longest} bytes, in a path of {len(os.fsencode(path))}"
        expected, remedy = f"names of at most {NAME_BYTES} bytes, {PATH_BYTES} in all", "Choose a shorter one."
        raise InputError(f"{str(path)[:LONGEST_NAME]}…", expected=expected, found=found, remedy=remedy)


def _create(temporary: Path) -> int:
    """Make an empty file that was not there, and follow no link; the permissions that it got."""
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666)
    try:
        return stat.S_IMODE(os.fstat(descriptor).st_mode)
    finally:
        os.close(descriptor)


def _settle(temporary: Path, permissions: int) -> None:
    """Bring what was written to the disk; some libraries make a file of their own, for its owner alone."""
    descriptor = os.open(temporary, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        os.fchmod(descriptor, permissions)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _write_error(error: Exception, temporary: Path) -> int | None:
    """The system's number of an error that kept a file from being written; None for any other."""
    if isinstance(error, OSError):
        own = error.filename is None or Path(os.fsdecode(error.filename)) == temporary
        return error.errno if own else None
    return told_number(error)


def told_number(error: Exception) -> int | None:
    """The system's number of an error of writing that a library tells in words alone; None if it tells none."""
    return next((number for number in UNWRITABLE if os.strerror(number) in str(error)), None)


def sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's content."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def tree_digest(root: Path) -> str:
    """One digest of a file, or of the names and contents of all files below a folder, links to folders followed."""
    if root.is_file():
        return sha256(root)
    lines = [f"{path.relative_to(root).as_posix()} {sha256(path)}" for path in sorted(_files_below(root))]
    # Names may have bytes that are no text, such as umlauts of an old archive.
    return hashlib.sha256("\n".join(lines).encode(errors="surrogateescape")).hexdigest()


def _files_below(root: Path) -> Iterator[Path]:
    """All files, also those behind links to folders; a link to a folder that it lies in is not followed."""
    for place, folders, names in os.walk(root, followlinks=True):
        folder = Path(place)
        above = {folder.resolve(), *folder.resolve().parents}
        folders[:] = [name for name in folders if (folder / name).resolve() not in above]
        yield from (folder / name for name in names if (folder / name).is_file())
