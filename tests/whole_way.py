"""The whole way from images to a report, as small as it goes, and what it comes to."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

import pandas as pd

#: The whole way, as small as it goes: ten seconds of one core.
TINY = {
    "stage": "report",
    "dataset.resolution": 16,
    "dataset.train_views": 3,
    "dataset.test_views": 1,
    "dataset.targets_per_class": 1,
    "dataset.samples": 1,
    "init.surfels": 120,
    "train.rounds": 1,
    "train.steps": 6,
    "train.checkpoint_every": 2,
    "train.gather_rays": 8,
    "train.patches": 20,
    # So few photographs make a poor scene.
    "fit.poor_scene": "true",
    "freeze.gather_rays": 8,
    "freeze.patches": 20,
    "freeze.dictionary_grid": 3,
    "report.views": "[1]",
    "fit.search.starts": 1,
    "fit.search.iterations": 2,
    "fit.adam.epochs": 1,
    "fit.adam.steps": 4,
}

ARGUMENTS = [f"{key}={value}" for key, value in TINY.items()]

#: Values that are measured of the machine: a training that went on from its checkpoint took less time and memory.
MEASURED = {"seconds", "median_seconds", "worst_seconds", "training_seconds", "milliseconds", "peak_memory_mib"}
MEASURED |= {"created", "resumed"}

#: How a sentence tells what a step costs.
COST = re.compile(r"costs \S+ ms")

#: What the text of a report and the checksums of files hold is the clock, too.
DIGEST = {"sha256", "bytes"}


def end_state(outputs: Path) -> dict[str, str]:
    """All that is in a store, but for what runs say of themselves: every name, and what stands there but for clocks."""
    found = {}
    for path in sorted(outputs.glob("*/*/**/*")):
        name = path.relative_to(outputs)
        # Toy stages keep a log of the processes that made them.
        if name.parts[0] == "runs" or path.name.startswith(".lock-") or path.suffix == ".log":
            continue
        if path.is_symlink():
            found[str(name)] = f"leads to {path.readlink()}"
        else:
            found[str(name)] = "a folder" if path.is_dir() else _content(path)
    return found


def differences(found: dict[str, str], expected: dict[str, str]) -> list[str]:
    """The names that one of two stores has alone, or with other content."""
    return sorted(name for name in found.keys() | expected.keys() if found.get(name) != expected.get(name))


def _content(path: Path) -> str:
    """What a file says, apart from what is measured of the machine."""
    if path.suffix == ".json":
        return json.dumps(_without_measured(json.loads(path.read_text())), sort_keys=True)
    if path.suffix == ".csv":
        table = pd.read_csv(path)
        return table.drop(columns=[name for name in table if name in MEASURED]).to_csv()
    return "a page" if path.suffix == ".html" else hashlib.sha256(path.read_bytes()).hexdigest()


def _without_measured(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_measured(item) for key, item in value.items() if key not in MEASURED | DIGEST}
    if isinstance(value, list):
        return [_without_measured(item) for item in value]
    return COST.sub("costs some ms", value) if isinstance(value, str) else value
