"""The tab key completes commands, stages, groups and keys of `rgspipe` in a shell."""

from __future__ import annotations

import os
import pty
import re
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from rgspipe.cli import main
from rgspipe.cli.completion import FIRST, SHELLS, completed
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


#: What is typed in each shell, and what the tab key makes of it.
TYPED = {
    "stage=fit": "stage=fit_light",
    "scene=tut": "scene=tutorial",
    "fit.sear": "fit.search.",
    "doc": "doctor",
    "doctor che": "doctor check=false",
}


@pytest.fixture
def environment(tmp_path: Path, child_environment: dict[str, str]) -> dict[str, str]:
    """One in which `rgspipe` is a program, and home a folder with nothing else in it."""
    program = tmp_path / "rgspipe"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m rgspipe "$@"\n')
    program.chmod(0o755)
    path = os.pathsep.join([str(tmp_path), os.environ["PATH"]])
    return child_environment | {"PATH": path, "HOME": str(tmp_path), "TERM": "dumb"}


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes_what_is_typed(tmp_path: Path, environment: dict[str, str]) -> None:
    script = ['eval "$(rgspipe --shell-completion install=bash)"']
    for line in TYPED:
        place = len(line.split())
        script.append(f"COMP_LINE='rgspipe {line}' COMP_POINT={len(line) + 8} COMP_CWORD={place}")
        script.append('hydra_bash_completion; echo "${COMPREPLY[@]}"')
    command = ["bash", "--norc", "-c", "\n".join(script)]
    result = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert result.stderr == ""
    assert result.stdout.splitlines() == [full.split()[-1] for full in TYPED.values()]
    assert [path.name for path in tmp_path.iterdir()] == ["rgspipe"]


@pytest.mark.skipif(shutil.which("zsh") is None, reason="no zsh")
def test_zsh_completes_what_is_typed(tmp_path: Path, environment: dict[str, str]) -> None:
    """On a terminal of its own, without any setting, where it has not begun to complete anything."""
    begin = 'eval "$(rgspipe --shell-completion install=zsh)"; print rea""dy\n'
    said = terminal(["zsh", "-f", "-i"], environment, tmp_path, [(begin, "ready"), *_keys(TYPED)])
    assert not re.search("error|not found|insecure", said)


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish")
def test_fish_completes_what_is_typed(tmp_path: Path, environment: dict[str, str]) -> None:
    (tmp_path / "data").mkdir()
    typed = TYPED | {"view da": "view data/", "scene=rgbd scene.path=da": "scene=rgbd scene.path=data/"}
    script = ["rgspipe --shell-completion install=fish | source"]
    script += [f"complete -C 'rgspipe {line}' | string replace -r '\\t.*' ''" for line in typed]
    command = ["fish", "--no-config", "-c", "\n".join(script)]
    result = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert result.stderr == ""
    assert result.stdout.splitlines() == [full.split()[-1] for full in typed.values()]


@pytest.mark.parametrize(
    "arguments", [["install=ksh"], [], ["install"], ["instal=bash"], ["install=bash", "stage=fit"]]
)
def test_other_shells_are_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """Hydra answered with a traceback."""
    assert main(["--shell-completion", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and all(shell in said.err for shell in SHELLS) and "install=bash" in said.err


def _keys(lines: Mapping[str, str]) -> list[tuple[str, str]]:
    """What is typed for each line, Ctrl-U before it, and what is then to be seen."""
    return [(f"\x15rgspipe {line}\t", full) for line, full in lines.items()]


def terminal(
    command: Sequence[str], environment: Mapping[str, str], folder: Path, talk: Sequence[tuple[str, str]]
) -> str:
    """What a program shows on a terminal, where each text is typed once the answer to the one before was seen."""
    own, its = pty.openpty()
    with subprocess.Popen(command, env=environment, cwd=folder, stdin=its, stdout=its, stderr=its) as process:
        os.close(its)
        try:
            return "".join(_answer(own, text, answer) for text, answer in talk)
        finally:
            process.kill()
            os.close(own)


def _answer(screen: int, text: str, answer: str, patience: float = 60.0) -> str:
    os.write(screen, text.encode())
    shown, end = "", time.monotonic() + patience
    while answer not in shown:
        assert select.select([screen], [], [], max(0.0, end - time.monotonic()))[0], f"{answer!r} not in {shown!r}"
        shown += os.read(screen, 4096).decode(errors="replace")
    return shown
