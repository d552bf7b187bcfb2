"""A Slurm cluster of one machine, in a folder of its own: munged, slurmctld and slurmd on loopback.

    with slurm_cluster() as environment:
        subprocess.run(["sinfo"], env=environment)

Needs Debian's slurm-wlm and munge (`apt-get install slurm-wlm munge`), touches nothing of an installed configuration,
and ends its daemons by their process ids.
"""

from __future__ import annotations

import contextlib
import getpass
import os
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

#: What has to be installed, and where the daemons are where the path of a user lacks them.
PROGRAMS = ("setpriv", "munged", "slurmctld", "slurmd", "sinfo", "squeue", "sbatch", "srun", "scancel")
PATH = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])

#: Seconds within which the node is idle; measured 1.5 on an idle machine.
START = 120.0

TEMPLATE = Path(__file__).with_name("slurm.conf")


def missing_programs() -> list[str]:
    """The programs of Slurm and munge that are not installed."""
    return [name for name in PROGRAMS if shutil.which(name, path=PATH) is None]


@contextlib.contextmanager
def slurm_cluster(slots: int = 4) -> Iterator[dict[str, str]]:
    """Start a cluster with one node of `slots` cores, real or not; gives the environment of its commands.

    Raises:
        RuntimeError: the node is not idle after a while; the message has the daemons' last words.
    """
    with tempfile.TemporaryDirectory(prefix="slurm-") as name, contextlib.ExitStack() as daemons:
        folder = Path(name)
        configuration = _configure(folder, slots)
        environment = {**os.environ, "PATH": PATH, "SLURM_CONF": str(configuration)}
        key, munge = folder / "munge.key", folder / "munge.socket"
        _start(daemons, folder, environment, "munged", "--foreground", "--force", f"--key-file={key}",
               f"--socket={munge}", f"--pid-file={folder / 'munged.pid'}", f"--seed-file={folder / 'munged.seed'}",
               f"--log-file={folder / 'munged.log'}")  # fmt: skip
        _wait(munge.exists, folder)
        # The controller last to stop, so that the node's daemon can take its leave.
        _start(daemons, folder, environment, "slurmctld", "-D", "-i", "-f", str(configuration))
        _start(daemons, folder, environment, "slurmd", "-D", "-f", str(configuration))
        _wait(lambda: _state(environment) == "idle", folder)
        try:
            yield environment
        finally:
            # Jobs that are still there would outlive the daemons.
            subprocess.run(["scancel", f"--user={getpass.getuser()}"], env=environment, capture_output=True)
            _wait(lambda: _state(environment) == "idle", folder)


def _configure(folder: Path, slots: int) -> Path:
    """Write munge's key and slurm.conf."""
    key = folder / "munge.key"
    key.touch(mode=0o600)
    key.write_bytes(secrets.token_bytes(128))
    ports = _free_ports(2)
    text = TEMPLATE.read_text()
    values = {
        "FOLDER": str(folder),
        "HOST": socket.gethostname().partition(".")[0],
        "USER": getpass.getuser(),
        "CONTROLLER_PORT": str(ports[0]),
        "NODE_PORT": str(ports[1]),
        "SLOTS": str(slots),
    }
    for name, value in values.items():
        text = text.replace(f"@{name}@", value)
    path = folder / "slurm.conf"
    path.write_text(text)
    return path


def _free_ports(count: int) -> list[int]:
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


def _start(daemons: contextlib.ExitStack, folder: Path, environment: dict[str, str], *command: str) -> None:
    """Start a daemon in the foreground; the stack ends it, and so does the system when this process is killed."""
    command = ("setpriv", "--pdeathsig=TERM", *command)
    with (folder / f"{command[2]}.out").open("wb") as output:
        process = subprocess.Popen(
            command, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True
        )
    daemons.callback(_stop, process)


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(timeout=10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _state(environment: dict[str, str]) -> str:
    answer = subprocess.run(
        ["sinfo", "--noheader", "--format=%T"], env=environment, capture_output=True, text=True, timeout=30
    )
    return answer.stdout.strip()


def _wait(condition, folder: Path) -> None:
    deadline = time.monotonic() + START
    while not condition():
        if time.monotonic() > deadline:
            words = [f"{path.name}: {path.read_text()[-1500:]}" for path in sorted(folder.glob("*.[lo][ou][gt]"))]
            raise RuntimeError("\n".join(["The cluster does not start.", *words]))
        time.sleep(0.1)


if __name__ == "__main__":
    # A cluster to try things on: runs the given command in it, by default a shell.
    with slurm_cluster() as settings:
        sys.exit(subprocess.run(sys.argv[1:] or ["bash"], env=settings).returncode)
