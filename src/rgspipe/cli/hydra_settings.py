"""Settings of Hydra itself that it would only stumble over once a run has begun."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence

from hydra.core.override_parser.types import Override

from rgspipe.datasets.input_file import is_plain_name
from rgspipe.datasets.json_file import shown
from rgspipe.errors import InputError

#: Sections whose keys that end so are levels of a log.
LOGS, LEVEL = ("hydra.job_logging.", "hydra.hydra_logging."), ".level"


def _is_level(value: object) -> bool:
    return str(value) in logging.getLevelNamesMapping() or (isinstance(value, int) and not isinstance(value, bool))


def _is_batch(value: object) -> bool:
    return value is None or (isinstance(value, int) and not isinstance(value, bool) and value > 0)


def _tells_jobs_apart(value: object) -> bool:
    name = str(value)
    return "${hydra.job." in name and "/" not in name and ".." not in name


#: By key: what a value must be, in words, and what to do about another one.
CHECKED: dict[str, tuple[Callable[[object], bool], str, str]] = {
    "hydra.job.name": (lambda value: is_plain_name(str(value)), "a plain name, which logs have", "Leave it away."),
    "hydra.sweeper.max_batch_size": (_is_batch, "a number of jobs above 0, or null", "Leave it away."),
    "hydra.sweep.subdir": (
        _tells_jobs_apart,
        "a plain name that differs from job to job",
        "Leave it away, or use ${hydra.job.num} in it.",
    ),
    "hydra.launcher.n_jobs": (lambda value: value != 0, "a number of jobs, or -1 for one a core", "1 is the least."),
    "hydra.mode": (lambda value: False, "no mode: -m makes a sweep of a run", "Leave it away, and add -m for a sweep."),
}


def check_hydra(overrides: Sequence[Override]) -> None:
    """Refuse such values.

    Raises:
        InputError: names the key.
    """
    for override in overrides:
        key = override.key_or_group
        check = CHECKED.get(key)
        if key.startswith(LOGS) and key.endswith(LEVEL):
            check = _is_level, "a level of a log, such as INFO or WARNING", "Choose one of them."
        if check is None or override.is_sweep_override() or override.is_delete():
            continue
        is_right, expected, remedy = check
        if not is_right(override.value()):
            found = shown((override.input_line or "").partition("=")[2])
            raise InputError(key, expected=expected, found=found, remedy=remedy)
