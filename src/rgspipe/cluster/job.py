"""One job of a sweep: what is sent to a node, and where its results go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra.core.singleton import Singleton
from hydra.core.utils import run_job, setup_globals
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf, open_dict
from submitit.helpers import DelayedSubmission


@dataclass(frozen=True)
class SweepTask:
    """What the jobs of a sweep have in common.

    Attributes:
        context: Hydra's, of the sweep.
        config: the sweep's configuration.
        function: what a job calls with its own configuration; returns its exit status.
    """

    context: HydraContext
    config: DictConfig
    function: TaskFunction

    def settled(self, overrides: Sequence[str], number: int) -> DictConfig:
        """The whole configuration of job `number`, with its own overrides."""
        config = self.context.config_loader.load_sweep_config(self.config, list(overrides))
        with open_dict(config):
            config.hydra.job.id = f"{config.hydra.job.name}_{number}"
            config.hydra.job.num = number
        return config


@dataclass(frozen=True)
class SweepJob:
    """A job, as it travels to the node that runs it.

    Attributes:
        task: what it shares with the other jobs.
        config: its own configuration.
        singletons: Hydra's state, which a new process lacks.
    """

    task: SweepTask
    config: DictConfig
    singletons: dict[Any, Any]

    @property
    def number(self) -> int:
        """The job's place in the sweep, from 0."""
        return int(self.config.hydra.job.num)

    @property
    def folder(self) -> Path:
        """Where it keeps its status file."""
        return Path(str(OmegaConf.select(self.config, "hydra.sweep.dir")), str(self.config.hydra.sweep.subdir))

    @property
    def overrides(self) -> list[str]:
        """All overrides of its configuration, those of the sweep included."""
        return list(self.config.hydra.overrides.task)

    def __call__(self) -> int:
        """Run the job in this process; its exit status."""
        setup_globals()
        Singleton.set_state(self.singletons)
        done = run_job(
            hydra_context=self.task.context,
            config=self.config,
            task_function=self.task.function,
            job_dir_key="hydra.sweep.dir",
            job_subdir_key="hydra.sweep.subdir",
        )
        return int(done.return_value)

    def checkpoint(self) -> DelayedSubmission:
        """What is queued again when the job's time is up: the same job, which goes on from what it has published."""
        return DelayedSubmission(self)
