"""A disk whose free room can be chosen, and a place beside it for notes."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

#: Says that this process has mounts of its own.
APART = "HAS_MOUNTS_OF_ITS_OWN"

#: Bytes of the disk.
SIZE = 2**29


@dataclass(frozen=True)
class Disk:
    """A folder on a disk of its own, if the system lets its users mount one.

    Attributes:
        root: the folder.
        notes: a folder on another disk.
        small: whether it is a disk of its own.
    """

    root: Path
    notes: Path
    small: bool

    @contextlib.contextmanager
    def nearly_full(self, room: int) -> Iterator[None]:
        """Leave only so many bytes free."""
        found, ballast = os.statvfs(self.root), self.root / "ballast"
        with ballast.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, max(found.f_bavail * found.f_frsize - room, 1))
        try:
            yield
        finally:
            ballast.unlink()


def go_apart() -> None:
    """Go on in a process with mounts of its own, where the system lets its users have them."""
    user = [] if os.geteuid() == 0 else ["--map-root-user"]
    command = ["unshare", *user, "--mount"]
    with contextlib.suppress(FileNotFoundError):
        if APART not in os.environ and subprocess.run([*command, "true"], capture_output=True).returncode == 0:
            os.environ[APART] = "yes"
            os.execvp(command[0], [*command, sys.executable, *sys.argv])


@contextlib.contextmanager
def own_disk() -> Iterator[Disk]:
    """A disk that is there for the block."""
    with tempfile.TemporaryDirectory() as place:
        root, notes = Path(place, "disk"), Path(place, "notes")
        for folder in (Path(place), root, notes):
            folder.mkdir(exist_ok=True)
            folder.chmod(0o777)
        mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE},mode=777", "none", str(root)]
        small = APART in os.environ and subprocess.run(mount, capture_output=True).returncode == 0
        try:
            yield Disk(root, notes, small)
        finally:
            if small:
                subprocess.run(["umount", "--lazy", str(root)], check=True)
