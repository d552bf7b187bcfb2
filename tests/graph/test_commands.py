"""Commands that can be pasted."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import pytest

from rgspipe.graph.commands import USUAL, command, program


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ([".venv/bin/python", "-m", "rgspipe", "stage=freeze"], (".venv/bin/python", "-m", "rgspipe")),
        (["python", "/somewhere/else/rgspipe", "stage=freeze"], ("/somewhere/else/rgspipe",)),
        (["python", "notebook.py"], USUAL),
        (["python"], USUAL),
    ],
)
def test_the_program_is_what_was_typed(
    typed: list[str], told: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "orig_argv", typed)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert program() == told


def test_a_program_that_was_found_by_its_name_keeps_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    script = tmp_path / "rgspipe"
    script.touch(mode=0o755)
    monkeypatch.setattr(sys, "orig_argv", ["python", str(script), "--help"])
    monkeypatch.setenv("PATH", str(tmp_path))
    assert program() == ("rgspipe",)


def test_settings_are_taken_over_but_for_those_that_change_and_quoted() -> None:
    overrides = ["stage=freeze", "upstream=require", "scene=tutorial", "light.count=[1,2]", "fit.target=a b", "seed=3"]
    told = command("view", overrides, {"seed": None, "views.indices": (0, 2), "fit.suggest_view": True})
    assert "'light.count=[1,2]'" in told and "'fit.target=a b'" in told  # a shell would take them apart
    begin = [*program(), "stage=view"]
    assert shlex.split(told) == [
        *begin,
        *overrides[2:5],
        "seed=null",
        "views.indices=[0,2]",
        "fit.suggest_view=true",
    ]
