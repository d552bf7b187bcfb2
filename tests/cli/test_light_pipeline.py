"""The pipeline of the studies of lights: its sweeps make the fits that the studies gather."""

from __future__ import annotations

import dataclasses
import itertools

import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.cli.sequence import SequenceStep, load_sequence
from rgspipe.cli.sweep_check import check_sweep
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.stages import NAMES, load_stage

#: Keys of how a run is done, which no fit depends on.
OPERATION = ("stage", "study")


def _settings(config: RgspipeConfig) -> str:
    return repr({key: value for key, value in dataclasses.asdict(config).items() if key not in OPERATION})


def _swept(step: SequenceStep) -> set[str]:
    """The settings of every job of a step whose sweeps are plain lists of values."""
    pairs = [text.partition("=") for text in step.overrides]
    choices = [[f"{key}={value}" for value in values.split(",")] for key, _, values in pairs]
    return {_settings(compose_config([f"stage={step.stage}", *chosen])) for chosen in itertools.product(*choices)}


def _gathered(step: SequenceStep) -> set[str]:
    """The settings of every evaluation that a study needs."""
    config = compose_config([f"stage={step.stage}", *step.overrides])
    needs = load_stage(step.stage).needs(config)
    return {_settings(with_changes(config, need.changes)) for need in needs if need.stage == "evaluate"}


def test_every_step_composes() -> None:
    for step in load_sequence("lights"):
        assert step.stage in NAMES
        check = check_sweep if step.sweep else compose_config
        check([f"stage={step.stage}", *step.overrides])


@pytest.mark.parametrize(("study", "left"), [("views", 0), ("views_corner", 0), ("robustness", 9), ("classes", 0)])
def test_what_is_swept_is_what_the_studies_need(study: str, left: int) -> None:
    """All of it, but for the single cases of robustness, which the study makes itself."""
    sweeps: list[SequenceStep] = []
    for step in load_sequence("lights"):
        if step.stage == "evaluate":
            sweeps.append(step)
        elif step.overrides == (f"experiment=light_{study}",):
            gathered, swept = _gathered(step), set[str]().union(*map(_swept, sweeps))
            assert swept <= gathered and len(gathered - swept) == left
            return
        else:
            sweeps.clear()
    pytest.fail("the pipeline has no such study")
