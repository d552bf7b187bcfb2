"""Pipelines as data."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.cli.compose import check_sweep, compose_config
from rgspipe.cli.sequence import load_sequence
from rgspipe.errors import InputError
from rgspipe.stages import NAMES


@pytest.mark.parametrize("name", ["reproduce", "smoke"])
def test_every_step_of_the_shipped_pipelines_composes(name: str) -> None:
    for step in load_sequence(name):
        assert step.stage in NAMES
        check = check_sweep if step.sweep else compose_config
        check([f"stage={step.stage}", *step.overrides])


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("steps: [", "YAML"),
        ("[1]", "steps"),
        ("steps: []", "steps"),
        ("steps: [{overrides: []}]", "step 1"),
        ("steps: [{stage: freeze, overides: []}]", "step 1"),
        ("steps: [{stage: freeze, overrides: a}]", "step 1"),
    ],
)
def test_a_damaged_pipeline_is_refused(tmp_path: Path, text: str, word: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=word):
        load_sequence(str(path))
