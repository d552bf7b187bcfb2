"""SIGKILL at twenty random moments over all stages: runs afterwards end with the result of an undisturbed one."""

from __future__ import annotations

import hashlib
import json
import random
import time
from pathlib import Path

import pytest

from warm_start import WarmStart
from whole_way import ARGUMENTS, results

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


def finish(folder: Path, warm_start: WarmStart) -> None:
    assert warm_start.start(folder, ARGUMENTS).wait(timeout=300) == 0, (folder / "stderr").read_text()[-3000:]


@pytest.mark.slow
def test_killed_runs_end_with_the_same_result(tmp_path: Path, warm_start: WarmStart) -> None:
    # Forked, not started anew: a third of each run would be imports, which write nothing that a kill could spoil.
    undisturbed = tmp_path / "undisturbed"
    undisturbed.mkdir()
    begin = time.monotonic()
    finish(undisturbed, warm_start)
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
            command = warm_start.start(folder, ARGUMENTS)
            try:
                status = command.wait(timeout=moments.uniform(0.1, 0.6) * whole)
                assert status == 0, (folder / "stderr").read_text()[-3000:]
                # Other work may have held up the first run: too long a time would leave most runs alive.
                whole = whole if attempt else time.monotonic() - begin
                break
            except TimeoutError:
                command.kill()
                kills += 1
                assert_nothing_half_made(folder)
        finish(folder, warm_start)
        assert results(folder) == expected
