"""A sweep on a cluster from its submission to its end: no job is lost, whatever becomes of the others."""

from __future__ import annotations

import logging
import sys
import textwrap
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, JobStatus, configure_log, filter_overrides

from rgspipe.cluster.job import SweepJob, SweepTask
from rgspipe.cluster.options import SlurmOptions
from rgspipe.cluster.queue import FORGOTTEN, JobState, cancel, job_states, require_slurm
from rgspipe.cluster.submit import LOG_LINK, remove_parcels, submit
from rgspipe.store.status import STATUS, read_status, record_killed

__all__ = ["SweepTask", "run_sweep"]

#: Seconds that a status file may take from the node that wrote it to this one, over a network file system.
SETTLING = 30.0

#: Slurm's states of a job whose status file says how it ended.
SPOKEN = ("COMPLETED", FORGOTTEN)

log = logging.getLogger(__name__)


def run_sweep(
    task: SweepTask, job_overrides: Sequence[Sequence[str]], first: int, options: SlurmOptions
) -> list[JobReturn]:
    """Submit a sweep's jobs, wait until each has ended, and see to it that each has a status file that says how.

    Ctrl-C takes the jobs out of the queue. If this process dies otherwise, they go on.

    Args:
        task: what the jobs have in common.
        job_overrides: the overrides of each job.
        first: the number of the first job.
        options: what the jobs need of the cluster.

    Returns:
        for each job its exit status.
    """
    configure_log(task.config.hydra.hydra_logging, task.config.hydra.verbose)
    state = Singleton.get_state()
    jobs = [
        SweepJob(task, task.settled(overrides, number), state) for number, overrides in enumerate(job_overrides, first)
    ]
    folder = Path(str(task.config.hydra.sweep.dir))
    require_slurm()
    for job in jobs:
        # Left by an earlier sweep in the same folder, it would be taken for this job's.
        (job.folder / STATUS).unlink(missing_ok=True)
    ids = submit(jobs, folder, options)
    log.info(_submitted(jobs, ids, folder))
    queued = dict(zip(ids, jobs, strict=True))
    try:
        for job_id, ended in _ends(ids, options.poll_s):
            _conclude(queued[job_id], job_id, ended)
    except KeyboardInterrupt:
        cancel(ids)
        raise
    remove_parcels(folder)
    return [_returned(job) for job in jobs]


def _submitted(jobs: Sequence[SweepJob], ids: Sequence[str], folder: Path) -> str:
    arrays = ", ".join(dict.fromkeys(job_id.partition("_")[0] for job_id in ids))
    lines = [f"  job {job.number}: {' '.join(filter_overrides(job.overrides))}" for job in jobs]
    return "\n".join([f"Slurm {arrays}: {len(jobs)} jobs; {folder}", *lines])


def _ends(ids: Sequence[str], pause: float) -> Iterator[tuple[str, JobState]]:
    """Every job, with its final state, as soon as Slurm says that it has ended."""
    open_jobs, shown = list(ids), ""
    while open_jobs:
        states = job_states(open_jobs)
        if states is not None:
            for job_id in [job_id for job_id in open_jobs if not states[job_id].alive]:
                open_jobs.remove(job_id)
                yield job_id, states[job_id]
            if open_jobs and (line := _progress(len(ids), open_jobs, states)) != shown:
                log.info(line)
                shown = line
        if open_jobs:
            time.sleep(pause)


def _progress(total: int, open_jobs: Sequence[str], states: Mapping[str, JobState]) -> str:
    waiting = [states[job] for job in open_jobs if states[job].name not in ("RUNNING", "COMPLETING")]
    reasons = Counter(state.reason for state in waiting if state.reason not in ("", "None"))
    why = f" ({reasons.most_common(1)[0][0]})" if reasons else ""
    ended, running = total - len(open_jobs), len(open_jobs) - len(waiting)
    return f"Slurm: {ended} of {total} jobs ended, {running} running, {len(waiting)} waiting{why}"


def _conclude(job: SweepJob, job_id: str, ended: JobState) -> None:
    """Say on stderr how a job failed; one that could not say so itself was killed."""
    status = _settled_status(job.folder, SETTLING if ended.name in SPOKEN else 0.0)
    if status is None or status["state"] not in ("done", "failed"):
        error = f"Slurm ended job {job_id}: {ended.name}. Its output is in {job.folder / LOG_LINK}."
        status = record_killed(job.folder, job.overrides, error)
    if status["state"] != "done":
        text = f"Job {job.number} {status['state']}: {status['error']}"
        print(textwrap.fill(text, 110, break_long_words=False, break_on_hyphens=False), file=sys.stderr)


def _settled_status(folder: Path, patience: float) -> dict | None:
    """The status that a job has left, once it is final or `patience` [s] is over."""
    deadline = time.monotonic() + patience
    while True:
        status = read_status(folder)
        if (status is not None and status["state"] in ("done", "failed")) or time.monotonic() > deadline:
            return status
        time.sleep(1.0)


def _returned(job: SweepJob) -> JobReturn:
    status = read_status(job.folder)
    assert status is not None
    done = JobReturn(overrides=job.overrides, status=JobStatus.COMPLETED)
    done.return_value = int(status["exit_code"])
    return done
