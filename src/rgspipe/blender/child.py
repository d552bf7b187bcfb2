"""The process in which Blender renders: it takes a job, tells how far it is, and dies with who wants the images."""

from __future__ import annotations

import ctypes
import json
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from rgspipe.blender.process import MESSAGE_PREFIX
from rgspipe.errors import InputError
from rgspipe.store.whole_files import WholeFiles

#: Linux: prctl option by which a process is killed when its parent dies.
PR_SET_PDEATHSIG = 1


class Named(Protocol):
    """An image to render."""

    @property
    def name(self) -> str:
        """Its name among the images."""
        ...


FrameType = TypeVar("FrameType", bound=Named)


@dataclass(frozen=True)
class Parent:
    """The process that wants the images.

    Attributes:
        number: its process id.
    """

    number: int

    def remark(self, text: str) -> None:
        """Have the parent say something to people."""
        _tell(remark=text)

    def require(self) -> None:
        """End this process if the parent has ended."""
        if os.getppid() != self.number:
            sys.exit("The process that asked for these images is gone.")


class Frames(Generic[FrameType]):
    """The frames that are rendered into a folder, which keeps a record of those that are whole.

    Args:
        parent: which is told how far it is.
        folder: that they are rendered into.
        files: of a frame, below the folder.
    """

    def __init__(self, parent: Parent, folder: Path, files: Callable[[FrameType, Path], Sequence[Path]]) -> None:
        self._parent, self._folder, self._files = parent, folder, files
        self._whole = WholeFiles(folder)

    def missing(self, frames: Sequence[FrameType]) -> list[FrameType]:
        """Those that are not there as they were written; the parent is told how many there are and what was damaged."""
        missing = [frame for frame in frames if not self._whole.has(*self._files(frame, self._folder))]
        damaged = sum(self._files(frame, self._folder)[-1].exists() for frame in missing)
        _tell(total=len(frames), done=len(frames) - len(missing), damaged=damaged)
        return missing

    def each(self, frames: Iterable[FrameType]) -> Iterator[FrameType]:
        """Frame by frame, which is noted and the parent told of when it is done; ends this process if that is gone."""
        for frame in frames:
            self._parent.require()
            yield frame
            self._whole.add(*self._files(frame, self._folder))
            _tell(frame=frame.name)


def serve(render: Callable[[dict, Path, Parent], None]) -> None:
    """Be the process that `run_blender` starts: `render(job, folder, parent)`, and end."""
    status = _serve(render)
    sys.stdout.flush()
    sys.stderr.flush()
    # Blender's destructors may crash after all work is done; nothing is left to be closed.
    os._exit(status)


def _serve(render: Callable[[dict, Path, Parent], None]) -> int:
    job, folder, parent = Path(sys.argv[1]), Path(sys.argv[2]), Parent(int(sys.argv[3]))
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    _die_with(parent)
    try:
        render(json.loads(job.read_text(encoding="utf-8")), folder, parent)
    except InputError as error:
        parts = {"where": error.where, "expected": error.expected, "found": error.found, "remedy": error.remedy}
        _tell(input_error=parts)
        return 2
    return 0


def _tell(**message: object) -> None:
    """Send one message to the parent."""
    print(MESSAGE_PREFIX + json.dumps(message), flush=True)


def _die_with(parent: Parent) -> None:
    """Have this process killed when its parent dies, so that no orphan goes on writing (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    parent.require()  # it may have died before the call
