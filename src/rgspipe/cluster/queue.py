"""What Slurm says about jobs.

Asked of `squeue`, which every cluster has; `sacct` needs an accounting database. Slurm forgets a job some minutes
after its end (MinJobAge), so one that is not listed has ended.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass

from rgspipe.errors import InputError

#: States of a job that may still end well; every other one is final.
ALIVE = frozenset(
    [
        "PENDING",
        "CONFIGURING",
        "RUNNING",
        "COMPLETING",
        "SUSPENDED",
        "STOPPED",
        "SIGNALING",
        "STAGE_OUT",
        "RESIZING",
        "REQUEUED",
        "REQUEUE_FED",
        "REQUEUE_HOLD",
        "RESV_DEL_HOLD",
        "SPECIAL_EXIT",
    ]
)

#: The state of a job that Slurm no longer knows.
FORGOTTEN = "FORGOTTEN"

#: Seconds that a busy controller has for an answer.
PATIENCE = 120


@dataclass(frozen=True)
class JobState:
    """A job's state in Slurm's words, and why it waits if it does."""

    name: str
    reason: str = ""

    @property
    def alive(self) -> bool:
        """Whether the job waits or runs."""
        return self.name in ALIVE


def require_slurm() -> None:
    """Refuse to go on where Slurm's commands are not.

    Raises:
        InputError: one of them is not on the path.
    """
    missing = [name for name in ("sbatch", "srun", "squeue", "scancel") if shutil.which(name) is None]
    if missing:
        raise InputError(
            "hydra/launcher=slurm",
            expected="Slurm's commands on the path, as on a cluster's login node",
            found=f"no {', '.join(missing)}",
            remedy="Start the sweep on the cluster, or here with launcher=joblib.",
        )


def job_states(ids: Iterable[str]) -> dict[str, JobState] | None:
    """The state of each job by its id, such as 12 or 12_3; None if Slurm gives no answer at the moment."""
    command = ["squeue", "--noheader", "--array", "--states=all", f"--user={os.getuid()}", "--format=%i|%T|%r"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return None
    if answer.returncode != 0:
        return None
    listed = parse_queue(answer.stdout)
    return {job: listed.get(job, JobState(FORGOTTEN)) for job in ids}


def parse_queue(text: str) -> dict[str, JobState]:
    """Job states by id from lines of `id|state|reason`."""
    rows = [line.strip().split("|", 2) for line in text.splitlines() if line.count("|") >= 2]
    return {job: JobState(state, reason) for job, state, reason in rows}


def cancel(ids: Iterable[str]) -> None:
    """Take jobs out of the queue, whole arrays at a time; those that have ended are passed over."""
    arrays = sorted({job.partition("_")[0] for job in ids})
    subprocess.run(["scancel", "--quiet", *arrays], capture_output=True, timeout=PATIENCE)
