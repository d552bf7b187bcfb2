"""Where compiled kernels are kept: where Warp keeps them, or, without room or right there, in a folder of this process.

Warp's compiler ends the process where it cannot write.
"""

from __future__ import annotations

import atexit
import contextlib
import logging
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import warp as wp

from rgspipe.errors import InputError

#: Bytes that must be free: all kernels take 1 MB, and as much again while they are compiled.
ROOM = 4 * 2**20

#: The variable by which Warp is told where to keep kernels.
PLACE = "WARP_CACHE_PATH"

log = logging.getLogger(__name__)


def start_with_cache(start: Callable[[], None]) -> None:
    """Start Warp with a folder for kernels that can be written to.

    Args:
        start: starts it with the folder of `wp.config.kernel_cache_dir`, or its own choice.

    Raises:
        InputError: there is none, neither where Warp keeps them nor among temporary files.
    """
    try:
        start()
        why = _refusal(Path(wp.config.kernel_cache_dir))
    except OSError as error:  # it cannot make its folder
        why = f"{error.filename}: {error.strerror}"
    if why is None:
        return
    usual = wp.config.kernel_cache_dir
    wp.config.kernel_cache_dir = str(_own_folder(why))
    if usual is not None:
        # What is compiled already can still be read.
        with contextlib.suppress(OSError, shutil.Error):
            shutil.copytree(usual, wp.config.kernel_cache_dir, dirs_exist_ok=True)
    start()
    log.warning("Kernels are compiled for this run alone, as they cannot be kept (%s). %s=FOLDER helps.", why, PLACE)


def _own_folder(why: str) -> Path:
    """A new temporary folder, which goes when the process ends."""
    try:
        folder = Path(tempfile.mkdtemp(prefix="rgspipe-kernels-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        again = _refusal(folder)
    except OSError as error:
        again = f"{error.filename or tempfile.gettempdir()}: {error.strerror}"
    if again is None:
        return folder
    expected = f"a folder with room for {ROOM >> 20} MiB of compiled kernels"
    remedy = f"Free some, or name another folder: {PLACE}=FOLDER."
    raise InputError(PLACE, expected=expected, found=f"none ({why}; {again})", remedy=remedy)


def _refusal(folder: Path) -> str | None:
    """Why kernels cannot be written into a folder; None if they can. Quotas show when something is written alone."""
    try:
        with tempfile.TemporaryFile(dir=folder) as stream:
            stream.write(bytes(ROOM))
    except OSError as error:
        return f"{folder}: {error.strerror}"
    return None
