"""What a cluster is asked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass
class SlurmOptions:
    """`hydra.launcher.*` of `hydra/launcher=slurm`; what is null is left to the cluster."""

    _target_: str = "hydra_plugins.rgspipe_slurm.SlurmLauncher"
    #: What to run on, as in sbatch's options of these names.
    partition: str | None = None
    account: str | None = None
    qos: str | None = None
    constraint: str | None = None
    #: Longest run time of a job, minutes.
    timeout_min: int = 60
    #: How often a job that reaches it is queued again; it goes on from its last checkpoint.
    max_num_timeout: int = 0
    #: Seconds before the end of that time at which a job is told.
    signal_delay_s: int = 90
    #: Cores of a job, which are its threads too.
    cpus_per_task: int = 2
    #: Memory of a job, GB.
    mem_gb: float | None = None
    gpus_per_node: int | None = None
    #: Jobs of one array that run at once.
    array_parallelism: int = 256
    #: Jobs of one array; a larger sweep becomes several. Slurm's own limit is MaxArraySize, 1001 by default.
    array_size: int = 1000
    #: Name of the jobs in the queue.
    name: str = "rgspipe"
    #: Shell commands before each job, such as "module load cuda".
    setup: list[str] = field(default_factory=list)
    #: Any other option of sbatch, such as {mail-type: END}.
    additional_parameters: dict[str, Any] = field(default_factory=dict)
    #: Seconds between two looks at the queue.
    poll_s: float = 10.0
