"""The tab key completes commands, stages, groups and keys of `rgspipe` in a shell."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rgspipe.cli.completion import FIRST, completed
from rgspipe.stages import NAMES


@pytest.mark.parametrize(
    ("line", "words", "is_open"),
    [
        ("rgspipe ", ["pipeline=", *FIRST], True),
        ("rgspipe st", ["status"], True),
        ("rgspipe outputs pr", ["prune"], False),
        ("rgspipe outputs ", list(FIRST["outputs"]), False),
        ("rgspipe view ", [], False),
        ("rgspipe view FOLDER ta", ["target="], False),
        ("rgspipe --help sce", ["scenes", "scene"], False),
        ("rgspipe --help fit", ["fit_light", "fit"], False),
        ("rgspipe stage=fit", ["stage=fit_light"], False),
        ("rgspipe scene=tutorial stage=", [*(f"stage={name}" for name in NAMES), "stage=view"], False),
        ("rgspipe pipeline=sm", ["pipeline=smoke"], False),
        ("rgspipe stage=fit_light fit.", [], True),
        ("rgspipe", ["pipeline=", *FIRST], True),
        ("", ["pipeline=", *FIRST], True),
    ],
)
def test_commands_stages_and_pipelines_are_known(line: str, words: list[str], is_open: bool) -> None:
    assert completed(line) == (words, is_open)


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes_what_is_typed(tmp_path: Path, child_environment: dict[str, str]) -> None:
    program = tmp_path / "rgspipe"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m rgspipe "$@"\n')
    program.chmod(0o755)
    lines = ["stage=fit", "scene=tut", "fit.sear", "doc", "doctor che"]
    script = ['eval "$(rgspipe --shell-completion install=bash)"']
    for line in lines:
        place = len(line.split())
        script.append(f"COMP_LINE='rgspipe {line}' COMP_POINT={len(line) + 8} COMP_CWORD={place}")
        script.append('hydra_bash_completion; echo "${COMPREPLY[@]}"')
    environment = child_environment | {"PATH": os.pathsep.join([str(tmp_path), os.environ["PATH"]])}
    command = ["bash", "--norc", "-c", "\n".join(script)]
    result = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert result.stderr == ""
    assert result.stdout.splitlines() == ["stage=fit_light", "scene=tutorial", "fit.search.", "doctor", "check=false"]
    assert [path.name for path in tmp_path.iterdir()] == ["rgspipe"]
