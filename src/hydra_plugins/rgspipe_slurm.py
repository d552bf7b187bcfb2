"""`hydra/launcher=slurm`: the jobs of a sweep as job arrays of a Slurm cluster.

Hydra takes launchers from the package `hydra_plugins` alone and imports all of it at every start, so this file holds
no more than Hydra has to see; the work is in `rgspipe.cluster`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hydra.core.config_store import ConfigStore
from hydra.core.utils import JobReturn
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf

from rgspipe.cli.messages import EXIT_INPUT, show_input_error
from rgspipe.cluster.options import SlurmOptions
from rgspipe.errors import InputError


class SlurmLauncher(Launcher):
    """Submits a sweep, waits for it, and says how each job ended."""

    def __init__(self, **options: Any) -> None:
        self.options = SlurmOptions(**{key: _plain(value) for key, value in options.items()})

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Take what Hydra hands to every launcher."""
        self.hydra_context, self.task_function, self.config = hydra_context, task_function, config

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> Sequence[JobReturn]:
        """Run one job for each list of overrides; how a job ended is in the status file of its folder."""
        from rgspipe.cluster.sweep import SweepTask, run_sweep

        task = SweepTask(self.hydra_context, self.config, self.task_function)
        try:
            return run_sweep(task, job_overrides, initial_job_idx, self.options)
        except InputError as error:
            # Hydra would show it as a traceback.
            show_input_error(error)
            raise SystemExit(EXIT_INPUT) from None


def _plain(value: Any) -> Any:
    return OmegaConf.to_container(value, resolve=True) if OmegaConf.is_config(value) else value


ConfigStore.instance().store(group="hydra/launcher", name="slurm", node=SlurmOptions, provider="rgspipe")
