"""SIGKILL at twenty random moments over all stages: runs afterwards end with the result of an undisturbed one."""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

from whole_way import finish, results, start

KILLS = 20


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
