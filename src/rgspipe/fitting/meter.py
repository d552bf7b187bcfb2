"""What a fit takes: its clock, the steps and renderings that are counted, and how far it is."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Self

from rgspipe.fitting.course import Course


@dataclass
class Meter:
    """Made where a fit begins, and carried by whatever works for it.

    Attributes:
        iterations: steps that were taken.
        evaluations: renderings of a light.
        course: how far the fit is; told nobody unless one is given.
    """

    iterations: int = 0
    evaluations: int = 0
    course: Course = field(default_factory=Course)
    _begin: float = field(default_factory=time.perf_counter, init=False)

    @classmethod
    @contextmanager
    def shown(cls, effort: float) -> Iterator[Self]:
        """Of a fit of some effort, which is shown while it takes."""
        with Course.shown(effort) as course:
            yield cls(course=course)

    @property
    def seconds(self) -> float:
        """Since the fit began."""
        return time.perf_counter() - self._begin
