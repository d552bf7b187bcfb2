"""The line at the end of a run or a sweep that says what usually comes next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rgspipe.cli.compose import compose_config
from rgspipe.cli.sweep_table import STAGE_TABLES
from rgspipe.config import RgspipeConfig
from rgspipe.graph.commands import command
from rgspipe.stages.following import Following, following
from rgspipe.store.artifacts import ArtifactStore, Key

#: A job of a sweep: its folder, and its status.
Job = tuple[Path, Mapping[str, Any]]


def lead_on(config: RgspipeConfig, result: Path, overrides: Sequence[str]) -> None:
    """Print what usually comes after a run, with the command or the file for it."""
    found = _following(config, result)
    if found is not None:
        print(f"Next, {found.purpose}: {_what(found, result, overrides)}")


def lead_on_sweep(overrides: Sequence[str], jobs: Sequence[Job], table: Path) -> None:
    """Print what usually comes after a sweep all of whose jobs are done.

    That is a sweep of the stage that the first and the last job lead on to, where it is the same; the table of what the
    jobs measured; or what comes after the last job. The others are not asked: there may be a hundred thousand.

    Args:
        overrides: of the sweep, with all values.
        jobs: in their order, at least one.
        table: of the sweep.
    """
    statuses = [status for _, status in jobs]
    first, last, name = _after(statuses[0]), _after(statuses[-1]), jobs[-1][0].name
    if last is not None and last.stage not in (None, "view") and first == last:
        print(f"Next, {last.purpose}: {command(last.stage, overrides, last.changes, sweep=True)}")
    elif any(status["stage"] in STAGE_TABLES for status in statuses):
        print(f"Next, compare what the jobs measured: {table}")
    elif last is not None:
        what = _what(last, Path(statuses[-1]["result"]), statuses[-1]["overrides"])
        print(f"Next, of job {name}, {last.purpose}: {what}")


def _after(status: Mapping[str, Any]) -> Following | None:
    return _following(compose_config(status["overrides"]), Path(status["result"]))


def _following(config: RgspipeConfig, result: Path) -> Following | None:
    key = Key(result.parts[-3], config.stage, result.name)
    made = ArtifactStore(Path(config.outputs)).find(key)
    return None if made is None else following(config, made)


def _what(found: Following, result: Path, overrides: Sequence[str]) -> str:
    return command(found.stage, overrides, found.changes) if found.stage else str(result / found.file)
