"""The whole way from images to a report, as small as it goes, and what it comes to."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

#: The whole way, as small as it goes: half a minute of one core.
TINY = {
    "stage": "report",
    "dataset.resolution": 32,
    "dataset.train_views": 5,
    "dataset.test_views": 1,
    "dataset.targets_per_class": 1,
    "dataset.samples": 1,
    "init.surfels": 400,
    "train.rounds": 2,
    "train.steps": 12,
    "train.checkpoint_every": 3,
    "train.gather_rays": 16,
    "train.patches": 40,
    # So few photographs make a poor scene.
    "fit.poor_scene": "true",
    "freeze.gather_rays": 16,
    "freeze.patches": 40,
    "freeze.dictionary_grid": 4,
    "report.views": "[1]",
    "fit.search.starts": 1,
    "fit.search.batches": 1,
    "fit.search.iterations": 4,
    "fit.adam.epochs": 1,
    "fit.adam.steps": 10,
}

ARGUMENTS = [f"{key}={value}" for key, value in TINY.items()]

#: Values that are measured of the machine: a training that went on from its checkpoint took less time and memory.
MEASURED = {"seconds", "median_seconds", "worst_seconds", "milliseconds", "peak_memory_mib"}


def start(folder: Path, environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "rgspipe", *ARGUMENTS]
    log = (folder / "log").open("ab")
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
    )


def finish(folder: Path, environment: Mapping[str, str]) -> None:
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
