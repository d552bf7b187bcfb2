"""Commands in processes that are forked from one which has imported all stages and read their code.

Such a process is as much one of its own as one that was started anew, and may be killed; but what it does from its
first moment on is its work, where a command started anew spends a third of a small one's time on imports.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import select
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self


class WarmStart:
    """A process that is ready to become commands, one at a time; a context manager."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        command = [sys.executable, "-m", "warm_start"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        # No buffers: `select` would not know of an answer that had been read with the one before.
        self._process = subprocess.Popen(command, env=environment, bufsize=0, **pipes)
        self._answer()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.communicate(timeout=60)

    def start(self, folder: Path, arguments: Sequence[str]) -> Command:
        """Start `python -m rgspipe` in a folder; its output goes to the files `stdout` and `stderr` in it."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps([str(folder), *arguments]).encode() + b"\n")
        return Command(self, self._answer())

    def _answer(self, timeout: float | None = None) -> int:
        assert self._process.stdout is not None
        if not select.select([self._process.stdout], [], [], timeout)[0]:
            raise TimeoutError
        return int(self._process.stdout.readline())


@dataclass(frozen=True)
class Command:
    """A command that is running."""

    place: WarmStart
    pid: int

    def wait(self, timeout: float | None = None) -> int:
        """The exit status.

        Raises:
            TimeoutError: it is still running after so many seconds.
        """
        return self.place._answer(timeout)

    def kill(self) -> None:
        """Kill it and all that it has started."""
        with contextlib.suppress(ProcessLookupError):  # it may have ended by itself just now
            os.killpg(self.pid, signal.SIGKILL)
        self.wait()


def _serve() -> None:
    """Become each command that is read, a folder and arguments; say its process and, in the end, its status."""
    from rgspipe.graph.resolver import NO_RESULT
    from rgspipe.graph.source_code import SourceCode
    from rgspipe.stages import NAMES, load_stage

    importlib.import_module("torch._dynamo")  # optimisers import it when they are made
    code = SourceCode(NO_RESULT)
    for name in NAMES:
        code.fingerprints(load_stage(name).run.__module__)
    # Else the garbage collection of every command goes through all that was imported, and copies its pages: a command
    # that is refused at once takes 0.6 s of CPU time, and took 2.0.
    gc.collect()
    gc.freeze()
    print(0, flush=True)
    for line in sys.stdin:
        process = os.fork()
        if process == 0:
            _become(*json.loads(line))
        with contextlib.suppress(PermissionError, ProcessLookupError):  # whichever of the two is first
            os.setpgid(process, process)
        print(process, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)


def _become(folder: str, *arguments: str) -> None:
    from rgspipe.cli import main

    os.setpgid(0, 0)
    os.chdir(folder)
    for number, name in enumerate((os.devnull, "stdout", "stderr")):
        os.dup2(os.open(name, os.O_RDWR | os.O_CREAT | os.O_TRUNC), number)
    sys.exit(main(arguments))


if __name__ == "__main__":
    _serve()
