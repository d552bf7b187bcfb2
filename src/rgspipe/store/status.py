"""A run's status file: running, done, or failed with the traceback; a run whose process is gone reads as killed."""

from __future__ import annotations

import datetime
import logging
import os
import shlex
import socket
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rgspipe.plain_values import as_shown
from rgspipe.store.files import write_json
from rgspipe.store.strict_json import parse_json

STATUS = "status.json"

#: How a run may stand.
STATES = ("running", "done", "failed", "stopped", "killed")

#: What became of a run that was stopped with Ctrl-C.
STOPPED = "stopped by the user"

#: What every status file says, and what one of a run that goes on, or is done, says as well.
NEEDED = {"state", "stage", "overrides"}
BESIDE = {"running": {"pid", "process_start"}, "done": {"result"}}

#: What is read of a status file, and what it is.
TYPES: Mapping[str, type | tuple[type, ...]] = {
    "state": str,
    "stage": str,
    "overrides": list,
    "host": str,
    "pid": int,
    "process_start": (str, type(None)),
    "result": str,
    "error": str,
    "seconds": (int, float),
    "exit_code": int,
}

log = logging.getLogger(__name__)


def _command(overrides: Sequence[str]) -> str:
    """How a run is started again, quoted for a shell."""
    return shlex.join(["python", "-m", "rgspipe", *map(as_shown, overrides)])


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def process_start(pid: int) -> str | None:
    """When a process started, as the system counts it; None if it is gone or a zombie, "?" if the system hides it.

    Together with the process id it names a process for good, as ids are used again.
    """
    stat = Path(f"/proc/{pid}/stat")
    if stat.is_file():
        # The name, in parentheses, may hold spaces; state and start time are fields 3 and 22.
        rest = stat.read_text().rpartition(")")[2].split()
        boot = Path("/proc/sys/kernel/random/boot_id")
        return None if rest[0] == "Z" else f"{boot.read_text().strip() if boot.is_file() else ''}:{rest[19]}"
    if Path("/proc/self/stat").is_file():
        return None
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except PermissionError:
        pass
    return "?"


@dataclass
class RunStatus:
    """Writes the status file of the run that is going on in this process."""

    folder: Path
    values: dict[str, Any]
    _clock: float

    @classmethod
    def start(cls, folder: Path, stage: str, overrides: Sequence[str]) -> RunStatus:
        """Say that a run has started; `folder` is made if need be."""
        folder.mkdir(parents=True, exist_ok=True)
        values = {
            "state": "running",
            "stage": stage,
            "overrides": list(overrides),
            "command": _command(overrides),
            "host": socket.gethostname(),
            "pid": os.getpid(),
            "process_start": process_start(os.getpid()),
            "started": _now(),
        }
        status = cls(folder, values, time.perf_counter())
        status._write()
        return status

    @property
    def path(self) -> Path:
        """The status file."""
        return self.folder / STATUS

    def done(self, result: Path) -> None:
        """Say that the run has made, or found, the artifact at `result`."""
        self._end("done", {"result": str(result), "exit_code": 0})

    def failed(self, error: BaseException, exit_code: int) -> None:
        """Say why the run has failed, with the traceback."""
        lines = traceback.format_exception(error)
        self._end("failed", {"error": str(error), "traceback": "".join(lines), "exit_code": exit_code})

    def stopped(self, exit_code: int) -> None:
        """Say that the user has stopped the run."""
        self._end("stopped", {"error": STOPPED, "exit_code": exit_code})

    def _end(self, state: str, more: Mapping[str, Any]) -> None:
        seconds = round(time.perf_counter() - self._clock, 3)
        self.values |= {"state": state, "ended": _now(), "seconds": seconds, **more}
        try:
            self._write()
        except OSError as error:  # what became of the run matters more, and is told besides
            log.warning("%s cannot be written: %s", self.path, error.strerror)

    def _write(self) -> None:
        write_json(self.path, self.values)


def read_status(folder: Path) -> dict[str, Any] | None:
    """The status of the run in `folder`, or None if none was started there.

    A file that cannot be read has the state "damaged".
    A run that says it is running, but whose process is gone, has the state "killed". Processes of another machine
    cannot be seen: its runs are believed.
    """
    path = folder / STATUS
    if not path.is_file():
        return None
    try:
        values = parse_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        values = None
    if not _is_status(values):
        return {"state": "damaged", "stage": "", "overrides": [], "command": "", "error": f"{path} cannot be read"}
    here = values.get("host", socket.gethostname()) == socket.gethostname()
    if values["state"] == "running" and here and process_start(values["pid"]) != values["process_start"]:
        values["state"] = "killed"
    return values


def _is_status(values: object) -> bool:
    """Whether a status file says what it should, in the types that it should have."""
    if not isinstance(values, dict) or not values.keys() >= NEEDED or values["state"] not in STATES:
        return False
    typed = all(isinstance(values[name], kind) for name, kind in TYPES.items() if name in values)
    no_truths = not any(isinstance(values.get(name), bool) for name in ("pid", "seconds", "exit_code"))
    named = values.keys() >= BESIDE.get(values["state"], set())
    return typed and no_truths and named and all(isinstance(text, str) for text in values["overrides"])


def record_killed(folder: Path, overrides: Sequence[str], error: str) -> dict[str, Any]:
    """Say for a run that could not say so itself, whether it had started or not, that it was killed, and by what."""
    folder.mkdir(parents=True, exist_ok=True)
    values = read_status(folder) or {"stage": "", "overrides": list(overrides), "command": _command(overrides)}
    values |= {"state": "killed", "ended": _now(), "error": error, "exit_code": 1}
    write_json(folder / STATUS, values)
    return values


def record_stopped(root: Path, exit_code: int) -> None:
    """Say of all runs below `root` that have not ended, or were killed, that the user has stopped them."""
    for folder, values in read_statuses(root):
        if values["state"] in ("running", "killed"):
            stopped = {"state": "stopped", "ended": _now(), "error": STOPPED, "exit_code": exit_code}
            write_json(folder / STATUS, values | stopped)


def read_statuses(root: Path) -> list[tuple[Path, dict[str, Any]]]:
    """(folder, status) of every run below `root`, sweep jobs in their order, oldest first."""
    folders = sorted((path.parent for path in root.rglob(STATUS)), key=_by_number)
    found = [(folder, read_status(folder)) for folder in folders]
    return [(folder, status) for folder, status in found if status is not None]


def _by_number(folder: Path) -> tuple[tuple[int, str], ...]:
    return tuple((int(part) if part.isdecimal() else -1, part) for part in folder.parts)
