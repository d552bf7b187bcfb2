"""`python -m rgspipe status`: how the runs and sweep jobs ended."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rgspipe.errors import InputError
from rgspipe.status import read_statuses


def show_runs(arguments: Sequence[str]) -> int:
    """Print a line for each run below outputs/runs (or `outputs=DIR`)."""
    outputs = given_outputs(arguments)
    runs = read_statuses(outputs / "runs")
    for folder, status in runs:
        seconds = f"{status['seconds']:.0f} s" if "seconds" in status else ""
        name = folder.relative_to(outputs / "runs")
        print(f"{status['state']:<8} {seconds:>7}  {name}  {' '.join(status['overrides'])}")
    if not runs:
        print(f"No runs in {outputs / 'runs'}.")
    return 0


def given_outputs(arguments: Sequence[str]) -> Path:
    """The folder of results that a command about what is there already names, or the usual one.

    Raises:
        InputError: it names something else.
    """
    outputs = Path("outputs")
    for text in arguments:
        if not text.startswith("outputs="):
            raise InputError(repr(text), expected="outputs=DIR", found="something else", remedy="Leave it away.")
        outputs = Path(text.partition("=")[2])
    return outputs
