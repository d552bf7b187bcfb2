"""Values of a sweep are checked before its first job starts."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from hydra.core.override_parser.types import Override, OverrideType
from omegaconf import DictConfig, OmegaConf

from rgspipe.cli.compose import compose_config, composed_values, parsed_overrides, typed
from rgspipe.cli.sweep_values import check_jobs, first_value, single_jobs
from rgspipe.config import RgspipeConfig

#: A sweep may have thousands of values; this many of each key are tried.
CHECKED_VALUES = 50


def check_sweep(overrides: Sequence[str]) -> RgspipeConfig:
    """Check every value of a sweep before its first job starts.

    Returns:
        the configuration of the first job.
    """
    parsed = parsed_overrides(overrides)
    check_jobs(parsed)
    first = [first_value(override) for override in parsed]
    values = composed_values(first)
    config = typed(values)
    for index, override in enumerate(parsed):
        others = [*parsed[:index], *parsed[index + 1 :]]
        texts = list(itertools.islice(single_jobs(override), CHECKED_VALUES))
        numbers = [one.value() for one in parsed_overrides(texts)]
        if len(texts) > 1 and _stands_alone(override, others) and _are_numbers(numbers, override, values):
            _check_numbers(numbers, override, values)
            continue
        for text in texts[1:]:
            compose_config([*first[:index], text, *first[index + 1 :]])
    return config


def _stands_alone(override: Override, others: Sequence[Override]) -> bool:
    """Whether no other override touches what one sets, nor a section that it is in."""
    own, keys = f"{override.key_or_group}.", [f"{other.key_or_group}." for other in others]
    return not any(key.startswith(own) or own.startswith(key) for key in keys)


def _are_numbers(found: Sequence[object], override: Override, values: DictConfig) -> bool:
    """Whether values of a sweep are numbers in the place of a number, `values` being those of its first job."""
    if override.type != OverrideType.CHANGE:
        return False
    return all(isinstance(one, int | float) for one in (*found, OmegaConf.select(values, override.key_or_group)))


def _check_numbers(numbers: Sequence[float], override: Override, values: DictConfig) -> None:
    """Check each number with what all others of the first job are: Hydra takes 0.1 s to compose them anew."""
    for number in (*numbers[1:], numbers[0]):
        OmegaConf.update(values, override.key_or_group, number)
        typed(values)
