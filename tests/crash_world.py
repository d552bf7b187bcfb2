"""Runs in processes of their own, forked from one that has imported everything, and what befalls them."""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path

import faults
from faults import Fault
from rgspipe.config import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.graph.pipeline import Usual, run
from rgspipe.graph.resolver import StageLoader

#: Exit statuses of a run that was refused, and of one that failed in any other way.
REFUSED, FAILED = 2, 1

#: prctl's word for adopting the children of processes that have died.
ADOPT = 36


@dataclass(frozen=True)
class User:
    """A member of a group who owns nothing else; what he makes is his group's, too."""

    number: int
    group: int

    def become(self) -> None:
        """Be this user from now on."""
        os.umask(0o002)
        os.setgroups([])
        os.setgid(self.group)
        os.setuid(self.number)


@dataclass(frozen=True)
class Way:
    """What is made: a configuration, and what gives its stages."""

    config: RgspipeConfig
    load_stage: StageLoader


@dataclass(frozen=True)
class Run:
    """A run that is going on, in a process group of its own.

    Attributes:
        pid: its process.
        told: the file with what it writes to the terminal.
    """

    pid: int
    told: Path

    @classmethod
    def start(cls, way: Way, folder: Path, told: Path, fault: Fault | None = None, user: User | None = None) -> Run:
        """Make a way in a folder, as a user who is not oneself, and suffer a fault."""
        sys.stdout.flush()
        pid = os.fork()
        if pid == 0:
            _become(way, folder, told, fault, user)
        with contextlib.suppress(PermissionError, ProcessLookupError):  # whichever of the two is first
            os.setpgid(pid, pid)
        return cls(pid, told)

    def wait(self, seconds: float) -> int:
        """The exit status, negative if it was killed.

        Raises:
            TimeoutError: it is still running after so many seconds.
        """
        descriptor = os.pidfd_open(self.pid)
        try:
            if not select.select([descriptor], [], [], seconds)[0]:
                raise TimeoutError
        finally:
            os.close(descriptor)
        status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        # What it had started is killed with it, and writes no more once it is buried.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            while True:
                os.waitpid(-self.pid, 0)
        return status

    def kill_after(self, seconds: float, patience: float) -> int:
        """Kill it and all that it has started after so many seconds, if it has not ended before; its exit status."""
        with contextlib.suppress(TimeoutError):
            return self.wait(seconds)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        return self.wait(patience)


def adopt() -> None:
    """Become the parent of whatever runs leave behind, so that it can be waited for."""
    ctypes.CDLL(None).prctl(ADOPT, 1, 0, 0, 0)


def make_here(way: Way, folder: Path) -> None:
    """Make a way in this process, so that whatever is forked from it need load nothing any more."""
    former = Path.cwd()
    os.chdir(folder)
    try:
        run(way.config, way.load_stage, usual=Usual(way.config))
    finally:
        os.chdir(former)


def _become(way: Way, folder: Path, told: Path, fault: Fault | None, user: User | None) -> None:
    """Be a run, in a child process; never returns."""
    status = FAILED
    try:
        os.setpgid(0, 0)
        for number, flags in enumerate((os.O_RDONLY, os.O_WRONLY, os.O_WRONLY)):
            os.dup2(os.open(told if number else os.devnull, flags | os.O_CREAT | os.O_APPEND), number)
        sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))  # noqa: SIM115
        os.chdir(folder)
        if user is not None:
            user.become()
        if fault is not None:
            os.environ |= fault.environment()
            faults.install(fault)
        run(way.config, way.load_stage, usual=Usual(way.config))
        status = 0
    except InputError as error:
        print(f"Error: {error}", file=sys.stderr)
        status = REFUSED
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)
