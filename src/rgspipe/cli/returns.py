"""What a job of a sweep hands back to the process that drives it."""

from __future__ import annotations

from typing import Any

from hydra.core.utils import JobReturn
from hydra.experimental.callback import Callback


class ExitStatusAlone(Callback):
    """Jobs come back without their configurations, 0.2 MiB each, which Hydra would keep until the sweep has ended."""

    def on_job_end(self, config: Any, job_return: JobReturn, **_: Any) -> None:
        """In the job's process, after it."""
        job_return.cfg = job_return.hydra_cfg = None
