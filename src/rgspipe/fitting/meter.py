"""What a fit takes: its clock, and the steps and renderings that are counted."""

from __future__ import annotations

import time
from dataclasses import dataclass, field


@dataclass
class Meter:
    """Made where a fit begins, and carried by whatever works for it.

    Attributes:
        iterations: steps that were taken.
        evaluations: renderings of a light.
    """

    iterations: int = 0
    evaluations: int = 0
    _begin: float = field(default_factory=time.perf_counter, init=False)

    @property
    def seconds(self) -> float:
        """Since the fit began."""
        return time.perf_counter() - self._begin
