"""Sweeps on a real cluster, of one machine: job arrays, killed and failed jobs, and going on afterwards.

`make test-slurm`; skipped where Slurm is not installed.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rgspipe.store.status import RunStatus
from slurm.cluster import missing_programs, slurm_cluster
from slurm.room import LIGHTS, write_room

pytestmark = [
    pytest.mark.slurm,
    pytest.mark.skipif(
        bool(missing_programs()),
        reason=f"needs Slurm (Debian: apt-get install slurm-wlm munge); there is no {', '.join(missing_programs())}",
    ),
]

LAUNCHER = ["hydra/launcher=slurm", "hydra.launcher.cpus_per_task=1", "hydra.launcher.poll_s=0.3"]

FITS = [
    "stage=fit_light",
    "scene=ply",
    "scene.path=room.ply",
    "freeze.gather_rays=64",
    "freeze.patches=150",
    "freeze.dictionary_grid=6",
    f"fit.target={','.join(LIGHTS)}",
    "views.count=1,2",
]


@pytest.fixture(scope="module")
def cluster(child_environment: dict[str, str]) -> Iterator[dict[str, str]]:
    """The environment of commands on a running cluster."""
    with slurm_cluster(slots=4) as environment:
        yield {**environment, "PYTHONPATH": child_environment["PYTHONPATH"]}


def start(folder: Path, environment: dict[str, str], *arguments: str, module: str = "rgspipe") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", module, "-m", *arguments, *LAUNCHER, "hydra.sweep.dir=sweep"],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # What runs in the background of a shell ignores interrupts, and so would its children.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.default_int_handler),
    )


def ended(sweep: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Exit status, output, and messages as one line."""
    output, messages = sweep.communicate(timeout=900)
    return sweep.returncode, output, " ".join(messages.split())


def wait_for(condition: Callable[[], bool], sweep: subprocess.Popen[str], timeout: float = 600.0) -> None:
    deadline = time.monotonic() + timeout
    while not condition():
        assert sweep.poll() is None, sweep.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)


def status(job: Path) -> dict:
    path = job / "status.json"
    return json.loads(path.read_text()) if path.is_file() else {"state": "not started"}


def slurm_id(job: Path) -> str:
    """Such as 1_3, from the name of the job's output."""
    return (job / "slurm.log").readlink().name.rpartition("_0_log")[0]


def how_often(folder: Path, words: str) -> int:
    """In how many jobs' output the words are."""
    return sum(words in log.read_text() for log in (folder / "sweep").glob("*/slurm.log"))


@pytest.mark.slow
def test_a_killed_fit_is_told_and_the_sweep_run_again_does_only_what_is_missing(
    cluster: dict[str, str], tmp_path: Path
) -> None:
    write_room(tmp_path)
    victim = tmp_path / "sweep" / "6"
    sweep = start(tmp_path, cluster, *FITS)
    # A job imports torch for some seconds before its fit.
    wait_for(lambda: status(victim)["state"] == "running", sweep)
    os.kill(status(victim)["pid"], signal.SIGKILL)
    code, output, messages = ended(sweep)
    assert code == 1 and "7 of 8 jobs done" in output
    assert f"Job 6 killed: Slurm ended job {slurm_id(victim)}: FAILED" in messages
    assert how_often(tmp_path, "freeze: made in") == 1, "jobs that start together need the same frozen scene"
    table = pd.read_csv(tmp_path / "sweep" / "table.csv")
    assert table["state"].tolist() == ["done"] * 6 + ["killed", "done"]
    assert table["x"].isna().tolist() == [False] * 6 + [True, False]

    (tmp_path / "sweep").rename(tmp_path / "first")
    code, output, messages = ended(start(tmp_path, cluster, *FITS))
    assert code == 0, messages
    assert "8 of 8 jobs done" in output
    assert how_often(tmp_path, "fit_light: made in") == 1 and "fit_light: made in" in (victim / "slurm.log").read_text()
    table = pd.read_csv(tmp_path / "sweep" / "table.csv")
    assert table["fit.target"].tolist() == [name for name in LIGHTS for _ in range(2)]
    assert table["views.count"].tolist() == [1, 2] * len(LIGHTS)
    positions = np.array([LIGHTS[name] for name in table["fit.target"]])
    # Measured 8e-8: the targets are the model's own images.
    np.testing.assert_allclose(table[["x", "y", "z"]], positions, atol=1e-5)
    assert not list((tmp_path / "sweep").rglob("*.pkl"))


def test_a_failed_job_is_told_with_its_paragraph_and_hides_no_other(cluster: dict[str, str], tmp_path: Path) -> None:
    code, output, messages = ended(start(tmp_path, cluster, "stage=break", "seed=0,1,2,3", module="toys"))
    assert code == 2
    assert "1 of 4 jobs done" in output
    assert "Job 1 failed: seed 1 breaks" in messages
    assert "Job 2 failed: seed: expected another one, found 2. Choose another." in messages
    # This one ends without a word of its own.
    assert "Job 3 killed: Slurm ended job" in messages and "Traceback" not in messages
    assert pd.read_csv(tmp_path / "sweep" / "table.csv")["state"].tolist() == ["done", "failed", "failed", "killed"]


def test_jobs_that_need_the_same_artifact_at_once_make_it_once(cluster: dict[str, str], tmp_path: Path) -> None:
    slow = {**cluster, "TOY_PAUSE": "0.3"}
    code, _, messages = ended(
        start(tmp_path, slow, "stage=grow", "views.count=1,2,3,4", "dataset.resolution=8", module="toys")
    )
    assert code == 0, messages
    assert len((tmp_path / "outputs" / "cornell" / "sow" / "made.log").read_text().split()) == 1
    assert how_often(tmp_path, "another process is making") >= 1
    # As many threads as cores were asked for, although the machine has more.
    facts = [json.loads(path.read_text())["facts"] for path in (tmp_path / "outputs").glob("*/grow/*/manifest.json")]
    assert {fact["threads"] for fact in facts} == {"1"}


def test_a_job_that_is_queued_again_goes_on_where_it_was(cluster: dict[str, str], tmp_path: Path) -> None:
    slow = {**cluster, "TOY_PAUSE": "0.2"}
    sweep = start(tmp_path, slow, "stage=sow", "dataset.resolution=16", module="toys")
    sown = tmp_path / "outputs" / "cornell" / "sow"
    wait_for(lambda: len(list(sown.glob(".partial-*/row_*.txt"))) >= 3, sweep)
    (first,) = sown.glob(".partial-*/row_00.txt")
    before = first.stat().st_mtime_ns
    # What Slurm sends before it takes a node away.
    subprocess.run(["scancel", "--signal=USR2", slurm_id(tmp_path / "sweep" / "0")], env=cluster, check=True)
    code, output, messages = ended(sweep)
    assert code == 0, messages
    assert "1 of 1 jobs done" in output
    manifest = json.loads((sown / "latest" / "manifest.json").read_text())
    assert manifest["resumed"] is True
    assert (sown / "latest" / "row_00.txt").stat().st_mtime_ns == before


def test_ctrl_c_takes_the_jobs_out_of_the_queue(cluster: dict[str, str], tmp_path: Path) -> None:
    slow = {**cluster, "TOY_PAUSE": "1"}
    sweep = start(tmp_path, slow, "stage=sow", "dataset.resolution=60,61,62,63,64,65", module="toys")
    wait_for(lambda: status(tmp_path / "sweep" / "0")["state"] == "running", sweep)
    sweep.send_signal(signal.SIGINT)
    code, _, messages = ended(sweep)
    assert code == 130 and "Interrupted" in messages
    deadline = time.monotonic() + 30
    while subprocess.run(["squeue", "--noheader"], env=cluster, capture_output=True, text=True).stdout:
        assert time.monotonic() < deadline
        time.sleep(0.2)


def test_what_the_cluster_refuses_is_one_paragraph(cluster: dict[str, str], tmp_path: Path) -> None:
    # A job of an earlier sweep in this folder is not taken for one of this.
    RunStatus.start(tmp_path / "sweep" / "0", "sow", []).done(tmp_path)
    refused = start(tmp_path, cluster, "stage=sow", "hydra.launcher.partition=nowhere", module="toys")
    code, output, messages = ended(refused)
    assert code == 2 and "0 of 0 jobs done" in output
    assert messages.startswith("Error: hydra.launcher: expected") and "nowhere" in messages
    assert "Traceback" not in messages
