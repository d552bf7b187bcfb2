"""What the overrides of a sweep stand for: the values of each, and how many are too many."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

from hydra.core.override_parser.types import Override
from hydra.errors import HydraException

from rgspipe.datasets.json_file import shown
from rgspipe.errors import InputError

#: Jobs of the largest sweep: each has a folder, and the driver keeps a line of it in memory.
MOST_JOBS = 100_000


def first_value(override: Override) -> str:
    """The override of the first job."""
    return next(single_jobs(override), override.input_line or "")


def single_jobs(override: Override) -> Iterator[str]:
    """The overrides of the single jobs that one override of a sweep stands for.

    Raises:
        InputError: it stands for none that could be listed.
    """
    if not override.is_sweep_override():
        yield override.input_line or ""
        return
    try:
        for value in override.sweep_string_iterator():
            yield f"{override.get_key_element()}={value}"
    except (HydraException, ValueError) as error:
        raise InputError(
            override.key_or_group,
            expected="values such as 1,2 or range(1,9)",
            found=f"{shown((override.input_line or '').partition('=')[2])} ({error})",
            remedy="List them, separated by commas.",
        ) from None


def job_overrides(overrides: Sequence[Override]) -> Iterator[list[str]]:
    """The overrides of each job of a sweep, in the order in which Hydra numbers them."""
    own = [override for override in overrides if not override.key_or_group.startswith("hydra")]
    return (list(job) for job in itertools.product(*map(single_jobs, own)))


def check_jobs(overrides: Sequence[Override]) -> None:
    """Refuse sweeps of too many jobs.

    Raises:
        InputError: names the key with the most values.
    """
    swept = [override for override in overrides if override.is_sweep_override()]
    counts = [sum(1 for _ in itertools.islice(single_jobs(override), MOST_JOBS + 1)) for override in swept]
    if math.prod(counts) > MOST_JOBS:
        most = max(zip(counts, swept, strict=True), key=lambda one: one[0])[1]
        found = f"{math.prod(counts)} or more"
        remedy = "Sweep over fewer values, or in several sweeps."
        raise InputError(most.key_or_group, expected=f"at most {MOST_JOBS} jobs", found=found, remedy=remedy)
