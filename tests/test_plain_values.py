"""Names of folders are typed as they are; what means something in Hydra's grammar is left to it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import QuotedString

from rgspipe.plain_values import as_shown, as_typed


def value(argument: str) -> object:
    read = OverridesParser.create().parse_override(as_typed(argument)).value()
    return read.text if isinstance(read, QuotedString) else read


@pytest.mark.parametrize(
    "name",
    ["Küche", "my room", "Fotos 28.11. (1)", "it's here", "a&b", "50 %", "#3", "run=2", "写真", "ü\\b", "ü\\'b", "ü\\"],
)
def test_a_name_is_read_as_it_is_typed(name: str) -> None:
    typed = f"scene.path={name}"
    assert value(typed) == name and as_shown(as_typed(typed)) == typed


def test_a_path_may_begin_at_home(monkeypatch: pytest.MonkeyPatch) -> None:
    """A shell reads `~` only after the name of a variable, which has no dot."""
    monkeypatch.setenv("HOME", "/home/ä")
    assert value("scene.path=~/room") == "/home/ä/room"
    assert value("scene.path=room~") == "room~"


@pytest.mark.parametrize(
    "argument",
    ["a=1", "a=null", "a=[1,2]", "a=1,2", "a=range(0,3)", "a='Küche'", 'a="Küche"', "a=${b}ü", "a={b: ü}", "-m", "ü"],
)
def test_what_means_something_stays(argument: str) -> None:
    assert as_typed(argument) == argument


def test_a_command_takes_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from rgspipe.cli import main

    folder = tmp_path / "Zimmer (süd)"
    assert main(["stage=import_scan", "scene=rgbd", f"scene.path={folder}", f"outputs={tmp_path}/aus"]) == 2
    assert "no such folder" in " ".join(capsys.readouterr().err.split())
