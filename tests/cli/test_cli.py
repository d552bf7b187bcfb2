"""The command line as people meet it: what it prints, its exit status, what it leaves behind."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rgspipe as rg
from rgspipe.cli import main
from rgspipe.cli.commands import COMMANDS
from rgspipe.cli.help import PAGES, help_text, sections, topics
from rgspipe.cli.messages import show_input_error
from rgspipe.errors import InputError
from rgspipe.stages import NAMES
from rgspipe.store.status import RunStatus

REFUSED, UNREAD = 2, 141


@pytest.fixture
def rgspipe(tmp_path: Path, child_environment: dict[str, str]):
    """Runs the real command line, or with `toys` the one with the toy stages, in an empty folder."""

    def call(*arguments: str, toys: bool = False, **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "toys" if toys else "rgspipe", *arguments],
            cwd=tmp_path,
            env={**child_environment, **environment},
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=60,
        )

    return call


def statuses(folder: Path) -> list[dict]:
    return [json.loads(path.read_text()) for path in sorted(folder.rglob("status.json"))]


def test_without_arguments_it_says_what_it_can_do(rgspipe) -> None:
    result = rgspipe()
    assert result.returncode == 0
    for word in ("rgspipe demo", "stage=evaluate", *(f"--help {page}" for page in PAGES)):
        assert word in result.stdout
    assert result.stdout == rgspipe("--help").stdout


@pytest.mark.parametrize("arguments", [[], ["--help"], ["--help", "fit"], ["status"]])
def test_nobody_need_read_on(arguments: list[str], tmp_path: Path, child_environment: dict[str, str]) -> None:
    """As with `rgspipe --help | head -1`: no traceback, also where the output is shorter than a pipe holds."""
    command = [sys.executable, "-m", "rgspipe", *arguments]
    started = subprocess.Popen(
        command, cwd=tmp_path, env=child_environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    started.stdout.close()
    assert started.stderr.read() == ""
    assert started.wait() == UNREAD


@pytest.mark.parametrize("words", ["--help", "status", "stage=sow"])
def test_there_may_be_no_room_for_what_is_said(tmp_path: Path, child_environment: dict[str, str], words: str) -> None:
    """A run is done all the same."""
    command = [sys.executable, "-m", "toys", words]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            command, env=child_environment, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == REFUSED
    assert "standard output: expected room" in done.stderr
    assert not {"Traceback", "HYDRA"} & set(re.findall(r"[A-Za-z]+", done.stderr))
    assert "=" not in words or (tmp_path / "outputs/cornell/sow/latest").exists()


@pytest.mark.parametrize("closed", ["1", "2"])
def test_what_is_said_may_be_closed(tmp_path: Path, child_environment: dict[str, str], closed: str) -> None:
    command = f'"$0" -m rgspipe status {closed}>&-'
    shell = ["sh", "-c", command, sys.executable]
    ended = subprocess.run(shell, cwd=tmp_path, env=child_environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0 and "Traceback" not in ended.stdout + ended.stderr


def test_a_terminal_may_know_ascii_alone(rgspipe) -> None:
    result = rgspipe("--help", "fit", PYTHONIOENCODING="ascii", PYTHONUTF8="0", LC_ALL="C")
    assert (result.returncode, result.stderr) == (0, "") and result.stdout.isascii()


def test_hydra_shows_the_whole_configuration(rgspipe) -> None:
    result = rgspipe("--cfg", "job", "stage=freeze", "seed=7")
    assert result.returncode == 0, result.stderr
    assert "stage: freeze" in result.stdout and "seed: 7" in result.stdout


def test_help_explains_stages_scenes_groups_and_keys_without_torch(rgspipe) -> None:
    told = rgspipe("--help", *PAGES).stdout
    for word in (*NAMES, "external", "draft | reference | standard", "upstream=require", "--dry-run", "dataset"):
        assert word in told
    assert "8 to 8192" in rgspipe("--help", "dataset.resolution").stdout
    code = "import sys; from rgspipe.cli import main; main(['--help']); sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


@pytest.mark.parametrize("asked", [(), *((page,) for page in PAGES), ("fit_light",), *((name,) for name in COMMANDS)])
def test_help_fits_a_screen(asked: tuple[str, ...]) -> None:
    """As a terminal opens: 80 columns and 24 lines, of which one is the next prompt's."""
    shown = help_text(asked).splitlines()
    assert len(shown) <= 23 and max(map(len, shown)) <= 80


#: Sections with more keys than a screen has lines.
LONG_SECTIONS = {"train"}


def test_help_of_a_section_fits_a_screen() -> None:
    """Those of 200 lines were as long as their keys' texts; parts of sections, such as fit.search, count as well."""
    keys = [setting.key.split(".") for settings in sections().values() for setting in settings]
    parts = dict.fromkeys(".".join(key[:depth]) for key in keys for depth in range(1, len(key)))
    shown = {part: help_text([part]).splitlines() for part in parts}
    assert {part for part, lines in shown.items() if len(lines) > 23} <= LONG_SECTIONS
    assert max(len(lines) for lines in shown.values()) <= 40
    assert max(len(line) for lines in shown.values() for line in lines) <= 80
    assert {"fit", "fit.search", "fit.search.bar"} < parts.keys()


def test_help_of_a_section_leads_to_all_that_its_keys_say() -> None:
    fit = {setting.key: setting for setting in sections()["fit"]}
    listed = help_text(["fit"])
    assert "--help KEY" in listed and "--help fit.search" in listed and "--help fit --all" in listed
    assert all(f"  {key} " in listed for key in fit if key.count(".") == 1)
    assert "39 keys: starts, " in listed and "  fit.search.starts " in help_text(["fit.search"])
    whole = help_text(["fit", "--all"])
    for key, setting in fit.items():
        assert help_text([key]) in whole
        assert " ".join(setting.meaning.split()) in " ".join(help_text([key]).split())


def test_no_line_of_help_is_wider_than_a_terminal() -> None:
    shown = help_text(list(topics())) + help_text([*topics(), "--all"])
    assert [line for line in shown.splitlines() if len(line) > 80] == []


def test_a_stage_is_explained_and_the_version_told(rgspipe) -> None:
    shown = rgspipe("--help", "fit_light").stdout
    assert "stage=fit_light" in shown and "--help fit" in shown
    told = rgspipe("--version").stdout
    assert told.startswith(f"rgspipe {rg.__version__}") and "torch" in told and "Python 3." in told


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_says_how_it_is_written(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"rgspipe {command}") and told.strip() == help_text([command])
    assert callable(COMMANDS[command].load())


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        ("status stae=done", "state="),
        ("status state=don", "state=done"),
        ("status scen=tutorial", "scene="),
        ("status output=here", "outputs="),
        ("outputs prun", "prune"),
        ("outputs stge=freeze", "stage="),
        ("doctor chek=false", "check="),
        ("verify output=here", "outputs="),
        ("view prot=80", "port="),
    ],
)
def test_a_misspelt_argument_of_a_command_is_told_with_what_it_may_have_meant(
    line: str, meant: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(line.split()) == REFUSED
    assert f"Did you mean {meant}?" in capsys.readouterr().err.replace("\n", " ")


def test_runs_are_asked_for_by_keys_that_only_they_know(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["status", "toy.key=1"]) == REFUSED
    RunStatus.start(tmp_path / "outputs" / "runs" / "one", "grow", ["+toy.key=1"])
    capsys.readouterr()
    assert main(["status", "+toy.key=1"]) == 0 and "one" in capsys.readouterr().out


@pytest.mark.parametrize("topic", ["blend", "scene=blend"])
def test_a_choice_is_explained(topic: str) -> None:
    assert help_text([topic]).startswith("scene=blend sets\n  # A Blender file of yours")


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["stage=fit_ligth"], "stage=fit_light"),
        (["stage=freeze", "dataset.resolutoin=3"], "dataset.resolution"),
        (["stage=freeze", "dry_run=true"], "Did you mean --dry-run?"),
        (["-m", "stage=freeze", "seed=1,x"], "seed"),
        (["pipeline=smok"], "pipeline=smoke"),
        (["--help", "fot"], "fit"),
        (["docter"], "Did you mean doctor?"),
        (["fit_ligth"], "Did you mean stage=fit_light?"),
        (["trian"], "Did you mean stage=train_surfels?"),
        (["--cfgg", "job"], "Did you mean --cfg?"),
        (["--stage", "fit_light"], "Write stage=VALUE, without dashes."),
        (["--scene=cornell"], "Write scene=cornell, without dashes."),
        (["--fit.search.bar.least=0.3"], "Write fit.search.bar.least=0.3, without dashes."),
        (["--nothing"], "--help options lists them."),
        (["stage=freeze", "scene=mesh", "scene.path=/etc/hostname"], "expected a mesh"),
    ],
)
def test_a_mistake_is_one_paragraph_and_leaves_nothing(
    rgspipe, tmp_path: Path, arguments: list[str], word: str
) -> None:
    result = rgspipe(*arguments)
    assert result.returncode == REFUSED
    assert result.stderr.startswith("Error: ") and word in result.stderr.replace("\n", " ")
    assert "Traceback" not in result.stderr and result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_a_run_prints_its_plan_and_result_and_leaves_a_status(rgspipe, tmp_path: Path) -> None:
    result = rgspipe("stage=grow", "dataset.resolution=8", toys=True)
    assert result.returncode == 0, result.stderr
    assert "Plan for cornell" in result.stdout and "not made yet" in result.stdout
    (status,) = statuses(tmp_path / "outputs" / "runs")
    assert (status["state"], status["stage"]) == ("done", "grow")
    manifest = json.loads((tmp_path / status["result"] / "manifest.json").read_text())
    assert manifest["facts"]["spinning"] == "PASSIVE"
    again = rgspipe("stage=grow", "dataset.resolution=8", toys=True)
    assert "reuse" in again.stdout and "make" not in again.stdout
    name = next((tmp_path / "outputs" / "runs").rglob("status.json")).parent.relative_to(tmp_path / "outputs" / "runs")
    assert "command" in rgspipe("status", str(name)).stdout
    assert rgspipe("status", "no_such_run").returncode == REFUSED
    assert "No such runs" in rgspipe("status", "state=failed").stdout
    listed = rgspipe("status")
    assert listed.stdout.count("done") == 2


@pytest.mark.parametrize("named", [(), ("old",)], ids=["in the list", "by its name"])
def test_what_would_steer_a_terminal_in_a_status_is_escaped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], named: tuple[str, ...]
) -> None:
    status = RunStatus.start(tmp_path / "runs/old", "freeze", ["scene.path=\x1b[2J"])
    status.failed(ValueError("\x1b]0;title\x07\nsecond"), 1)
    assert main(["status", f"outputs={tmp_path}", *named]) == 0
    told = capsys.readouterr().out
    assert "\\x1b[2J" in told and "\\x1b]0;title" in told
    assert not {"\x1b", "\x07"} & set(told)


@pytest.mark.parametrize("width", [60, 80, 200])
def test_what_went_wrong_fits_the_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], width: int
) -> None:
    """As an error, and in the list of runs in a few lines, of which the last says whether there is more."""
    monkeypatch.setenv("COLUMNS", str(width))
    assert main(["stage=nothing", "seed=1"]) == REFUSED
    told = capsys.readouterr().err.splitlines()
    assert len(told) > 1 and max(map(len, told)) <= min(width, 110)
    status = RunStatus.start(tmp_path / "runs/old", "freeze", [])
    status.failed(ValueError("word " * 100), 1)
    assert main(["status", f"outputs={tmp_path}"]) == 0
    _, *reason = capsys.readouterr().out.splitlines()
    assert len(reason) == 3 and max(map(len, reason)) <= min(width, 110) and reason[-1].endswith(" …")


@pytest.mark.parametrize("width", [60, 80, 200])
def test_what_a_run_was_started_with_fits_the_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    overrides = ["stage=freeze", "scene.path=/home/somebody/room.blend", *(f"train.number_{i}={i}" for i in range(20))]
    RunStatus.start(tmp_path / "runs/old", "freeze", overrides).done(tmp_path)
    assert main(["status", f"outputs={tmp_path}"]) == 0
    first, *more = capsys.readouterr().out.splitlines()
    assert first[18:].startswith("old  stage=freeze") and max(map(len, [first, *more])) <= min(width, 110)
    assert len(more) == 2 and more[-1].endswith(" …") and all(line[:18].isspace() for line in more)


def test_a_path_that_is_longer_than_a_line_stays_behind_the_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    path = "/" + 80 * "a"
    show_input_error(InputError(path, expected="a file", found="none", remedy="Name one."))
    assert capsys.readouterr().err == f"Error: {path}:\nexpected a file, found none. Name one.\n"


def test_a_failure_is_short_and_its_traceback_is_kept(rgspipe, tmp_path: Path) -> None:
    result = rgspipe("stage=break", "seed=1", toys=True)
    assert result.returncode == 1
    assert "RuntimeError: seed 1 breaks" in result.stderr and "status.json" in result.stderr
    assert "Traceback" not in result.stderr
    (status,) = statuses(tmp_path / "outputs")
    assert status["state"] == "failed" and "toys.py" in status["traceback"]
    shown = rgspipe("stage=break", "seed=1", "debug.traceback=true", toys=True)
    assert "Traceback" in shown.stderr
    refused = rgspipe("stage=break", "seed=2", toys=True)
    assert refused.returncode == REFUSED and "Traceback" not in refused.stderr
    assert "Traceback" in rgspipe("stage=break", "seed=2", toys=True, RGSPIPE_TRACEBACK="1").stderr


@pytest.mark.parametrize("folder", ["my runs/1", "${outputs}/${stage}-${seed}"])
def test_a_folder_for_the_run_may_be_given(rgspipe, tmp_path: Path, folder: str) -> None:
    result = rgspipe("stage=break", "seed=1", f"hydra.run.dir='{folder}'", toys=True)
    assert result.returncode == 1, result.stderr
    place = tmp_path / {"my runs/1": "my runs/1"}.get(folder, "outputs/break-1")
    assert [status["state"] for status in statuses(place)] == ["failed"]


@pytest.mark.slow
def test_one_failed_job_hides_no_other(rgspipe, tmp_path: Path) -> None:
    result = rgspipe("-m", "stage=break", "seed=0,1,2,4", "hydra.launcher.n_jobs=2", toys=True)
    assert result.returncode == REFUSED
    assert "2 of 4 jobs done" in result.stdout
    assert [status["state"] for status in statuses(tmp_path / "outputs" / "runs")] == [
        "done",
        "failed",
        "failed",
        "done",
    ]


@pytest.mark.slow
def test_sweep_jobs_share_what_they_need_and_run_in_processes_of_their_own(rgspipe, tmp_path: Path) -> None:
    command = ["-m", "stage=grow", "views.count=1,2,3", "dataset.resolution=8", "hydra.launcher.n_jobs=2"]
    result = rgspipe(*command, toys=True, TOY_PAUSE="0.05")
    assert result.returncode == 0, result.stderr
    jobs = statuses(tmp_path / "outputs" / "runs")
    assert [job["state"] for job in jobs] == ["done"] * 3
    sown = (tmp_path / "outputs" / "cornell" / "sow" / "made.log").read_text().splitlines()
    assert len(sown) == 1, "two jobs needed the same artifact and both made it"
    manifests = [json.loads((tmp_path / job["result"] / "manifest.json").read_text()) for job in jobs]
    assert all(manifest["facts"]["threads"] is not None for manifest in manifests), "jobs share the cores"
    again = rgspipe(*command, toys=True)
    assert again.returncode == 0 and "make " not in again.stdout


@pytest.mark.slow
def test_a_job_that_dies_is_told_as_killed(rgspipe) -> None:
    result = rgspipe("-m", "stage=break", "seed=3,0", "hydra.launcher.n_jobs=2", toys=True)
    assert result.returncode != 0
    assert "job 0: killed" in result.stdout
