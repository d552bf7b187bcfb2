"""Hand the jobs of a sweep to Slurm, as job arrays, with submitit."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Sequence
from pathlib import Path

import submitit
from submitit.core.utils import FailedJobError, FailedSubmissionError

from rgspipe.cluster.job import SweepJob
from rgspipe.cluster.options import SlurmOptions
from rgspipe.cluster.queue import cancel
from rgspipe.errors import InputError
from rgspipe.store.files import make_folder, point_at

#: Folder of a sweep with Slurm's script and the jobs' output.
LOGS = "slurm"

#: In a job's folder: leads to its output.
LOG_LINK = "slurm.log"

#: Options that are sbatch's own and that submitit does not translate.
PLAIN = ("partition", "account", "qos", "constraint")


def submit(jobs: Sequence[SweepJob], folder: Path, options: SlurmOptions) -> list[str]:
    """Queue the jobs and link their output into their folders.

    Args:
        jobs: at least one.
        folder: the sweep's, on the file system that all nodes share.
        options: what the jobs need.

    Returns:
        Slurm's id of each job.

    Raises:
        InputError: Slurm refuses them; then none is left in the queue.
    """
    ids: list[str] = []
    try:
        for start in range(0, len(jobs), options.array_size):
            part = jobs[start : start + options.array_size]
            # submitit would print Slurm's refusal besides raising it.
            with contextlib.redirect_stderr(io.StringIO()):
                submitted = _executor(folder / LOGS, options).submit_array(part)
            ids += [job.job_id for job in submitted]
            for job, queued in zip(part, submitted, strict=True):
                _link(job.folder / LOG_LINK, queued.paths.stdout)
    except (FailedJobError, FailedSubmissionError) as error:
        if ids:
            cancel(ids)
        raise _refused(error) from None
    return ids


def remove_parcels(folder: Path) -> None:
    """Remove the files in which jobs and their exit statuses travelled; scripts and output stay."""
    for path in (folder / LOGS).glob("*.pkl"):
        path.unlink(missing_ok=True)


def _executor(folder: Path, options: SlurmOptions) -> submitit.SlurmExecutor:
    executor = submitit.SlurmExecutor(folder.absolute(), max_num_timeout=options.max_num_timeout)
    wanted = {
        "job_name": options.name,
        "time": options.timeout_min,
        "cpus_per_task": options.cpus_per_task,
        "mem": None if options.mem_gb is None else f"{round(options.mem_gb * 1024)}M",
        "gpus_per_node": options.gpus_per_node,
        **{name: getattr(options, name) for name in PLAIN},
    }
    executor.update_parameters(
        **{name: value for name, value in wanted.items() if value is not None},
        array_parallelism=options.array_parallelism,
        signal_delay_s=options.signal_delay_s,
        stderr_to_stdout=True,
        # As many threads as cores, also where the cluster does not confine a job to its cores.
        setup=[f"export OMP_NUM_THREADS={options.cpus_per_task}", *options.setup],
        # Since Slurm 22.05 srun no longer takes this from sbatch.
        srun_args=[f"--cpus-per-task={options.cpus_per_task}"],
        additional_parameters=options.additional_parameters,
    )
    return executor


def _link(link: Path, log: Path) -> None:
    make_folder(link.parent)
    point_at(link, os.path.relpath(log, link.parent.resolve()))


def _refused(error: Exception) -> InputError:
    said = [line.strip() for line in str(error).splitlines() if line.strip().startswith("sbatch:")]
    found = " ".join(said) or " ".join(str(error).split())
    return InputError(
        "hydra.launcher",
        expected="options that the cluster accepts",
        found=found,
        remedy="Correct hydra.launcher.partition, account, timeout_min, mem_gb and so on; "
        "`sinfo` lists the partitions and their limits.",
    )
