"""SIGKILL at twenty random moments over all stages: runs afterwards end with the result of an undisturbed one."""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

KILLS = 20

#: The whole way, as small as it goes: about half a minute.
TINY = {
    "stage": "report",
    "dataset.resolution": 32,
    "dataset.train_views": 8,
    "dataset.test_views": 2,
    "dataset.targets_per_class": 1,
    "dataset.samples": 1,
    "init.surfels": 400,
    "train.rounds": 2,
    "train.steps": 12,
    "train.checkpoint_every": 3,
    "train.gather_rays": 16,
    "train.patches": 40,
    "freeze.gather_rays": 16,
    "freeze.patches": 40,
    "freeze.dictionary_grid": 4,
    "report.views": "[1]",
    "fit.adam.epochs": 1,
    "fit.adam.steps": 10,
}

#: Values that are measured of the machine: a training that went on from its checkpoint took less time and memory.
MEASURED = {"seconds", "median_seconds", "worst_seconds", "milliseconds", "peak_memory_mib"}


def start(folder: Path, environment: dict[str, str]) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "rgspipe", *(f"{key}={value}" for key, value in TINY.items())]
    log = (folder / "log").open("ab")
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
    )


def finish(folder: Path, environment: dict[str, str]) -> None:
    assert start(folder, environment).wait(timeout=300) == 0, (folder / "log").read_text()[-3000:]


def without_measured(value: object) -> object:
    if isinstance(value, dict):
        return {key: without_measured(item) for key, item in value.items() if key not in MEASURED}
    return [without_measured(item) for item in value] if isinstance(value, list) else value


def content(path: Path) -> str:
    """What a file says, apart from what is measured of the machine."""
    if path.suffix == ".json":
        return json.dumps(without_measured(json.loads(path.read_text())), sort_keys=True)
    if path.suffix == ".csv":
        table = pd.read_csv(path)
        return table.drop(columns=[name for name in table if name in MEASURED]).to_csv()
    return hashlib.sha256(path.read_bytes()).hexdigest()


def results(folder: Path) -> dict[str, str]:
    """Every file of every artifact; the report and the manifests hold the clock in their text."""
    found = {}
    for manifest in sorted((folder / "outputs").glob("*/*/*/manifest.json")):
        if manifest.parent.is_symlink() or manifest.parent.parent.name == "report":
            continue
        for name in json.loads(manifest.read_text())["files"]:
            path = manifest.parent / name
            found[str(path.relative_to(folder))] = content(path)
    return found


def assert_nothing_half_made(folder: Path) -> None:
    """A folder with an artifact's name has a manifest, and every file that the manifest lists is whole."""
    for artifact in (folder / "outputs").glob("*/*/*"):
        if artifact.is_symlink() or artifact.name.startswith(".") or artifact.parts[-3] == "runs":
            continue
        if not artifact.is_dir():
            continue
        for name, record in json.loads((artifact / "manifest.json").read_text())["files"].items():
            assert hashlib.sha256((artifact / name).read_bytes()).hexdigest() == record["sha256"], artifact / name


@pytest.mark.slow
@pytest.mark.xdist_group("kill")
def test_killed_runs_end_with_the_same_result(tmp_path: Path, child_environment: dict[str, str]) -> None:
    undisturbed = tmp_path / "undisturbed"
    undisturbed.mkdir()
    begin = time.monotonic()
    finish(undisturbed, child_environment)
    whole = time.monotonic() - begin
    expected = results(undisturbed)
    stages = {Path(name).parts[2] for name in expected}
    assert {"generate_dataset", "init_depth", "train_surfels", "freeze", "fit_light", "evaluate"} <= stages

    moments = random.Random(0)
    kills, rounds = 0, 0
    while kills < KILLS:
        folder = tmp_path / f"round_{rounds}"
        folder.mkdir()
        rounds += 1
        # A few kills while one result is made, so that they reach the later stages too.
        for attempt in range(KILLS - kills):
            begin = time.monotonic()
            process = start(folder, child_environment)
            try:
                process.wait(timeout=moments.uniform(0.1, 0.6) * whole)
                assert process.returncode == 0, (folder / "log").read_text()[-3000:]
                # Other work may have held up the first run: too long a time would leave most runs alive.
                whole = whole if attempt else time.monotonic() - begin
                break
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                kills += 1
                assert_nothing_half_made(folder)
        finish(folder, child_environment)
        assert results(folder) == expected
