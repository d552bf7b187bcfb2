"""What the program is called in what can be pasted."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rgspipe.program import USUAL, program


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
