"""The door of every reader: what is opened is a regular file of a size that can be meant."""

from __future__ import annotations

import stat
from pathlib import Path

from rgspipe.arguments import as_path
from rgspipe.datasets.reading_limits import RAISE, reading_limits
from rgspipe.errors import InputError
from rgspipe.store.files import LONGEST_NAME


def input_file(path: str | Path, expected: str, *, most_bytes: int | None = None) -> Path:
    """`path`, found to be a regular file; a pipe or a device would never end.

    Args:
        path: what is to be read.
        expected: what it should be, for errors.
        most_bytes: the size from which on no such file is meant.

    Raises:
        InputError: no such file, something else than a regular file, a name that cannot be, or that no text can say, or
            too large.
    """
    path = as_path(path, expected)
    try:
        status = path.stat()
    except FileNotFoundError:
        raise InputError(path, expected=expected, found="no such file", remedy="Check the path.") from None
    except (OSError, ValueError) as error:  # a name too long, a loop of links, no permission; a null in the name
        raise InputError(_short(path), expected=expected, found=_why(error), remedy="Check the path.") from None
    if not stat.S_ISREG(status.st_mode):
        found = "a folder" if stat.S_ISDIR(status.st_mode) else "no regular file but a pipe or a device"
        raise InputError(path, expected=expected, found=found, remedy="Check the path.")
    if most_bytes is not None and status.st_size > most_bytes:
        wanted = f"{expected} of at most {most_bytes} bytes"
        raise InputError(path, expected=wanted, found=f"{status.st_size} bytes", remedy=f"Check the file. {RAISE}")
    return path


def input_folder(path: str | Path, expected: str) -> Path:
    """`path`, found to be a folder.

    Raises:
        InputError: no such folder, a file or anything else, or a name that cannot be, or that no text can say.
    """
    path = as_path(path, expected)
    try:
        found = "a file" if stat.S_ISREG(mode := path.stat().st_mode) else "a pipe or a device"
    except FileNotFoundError:
        raise InputError(path, expected=expected, found="no such folder", remedy="Check the path.") from None
    except (OSError, ValueError) as error:
        raise InputError(_short(path), expected=expected, found=_why(error), remedy="Check the path.") from None
    if not stat.S_ISDIR(mode):
        raise InputError(path, expected=expected, found=found, remedy="Check the path.")
    return path


def folder_to_be(path: str | Path, expected: str) -> Path:
    """`path`, found to be a folder, or nothing yet.

    Raises:
        InputError: as `input_folder`, but for a folder that is not there.
    """
    path = as_path(path, expected)
    try:
        path.stat()
    except FileNotFoundError:
        return path
    except (OSError, ValueError):
        pass
    return input_folder(path, expected)


def is_there(path: Path) -> bool:
    """Whether there is anything of this name, which may be none that a file can have."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def check_pixel_count(path: Path, width: int, height: int, most: int | None = None) -> None:
    """Refuse an image that has no pixels, or more than `most`, by default those of `ReadingLimits`.

    Raises:
        InputError: naming the file and its size.
    """
    most = reading_limits().pixels if most is None else most
    if not (width >= 1 and height >= 1 and width * height <= most):
        raise InputError(
            path,
            expected=f"an image of 1 to {most} pixels",
            found=f"{width} × {height}",
            remedy=f"Export the image at a smaller size. {RAISE}",
        )


def is_plain_name(name: object) -> bool:
    """Whether `name` can be a visible file or folder of its own in a folder."""
    if not isinstance(name, str) or not name or name.startswith(".") or "/" in name or "\0" in name:
        return False
    return name.isprintable() and len(name.encode()) <= LONGEST_NAME


def _short(path: str | Path) -> str:
    text = str(path).encode(errors="replace").decode().replace("\0", "\\0")
    return text if len(text) <= 2 * LONGEST_NAME else f"{text[:LONGEST_NAME]}…"


def _why(error: OSError | ValueError) -> str:
    return f"no readable file ({error.strerror if isinstance(error, OSError) else error})"
