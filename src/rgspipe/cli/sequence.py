"""Named pipelines: the commands of pipelines/<name>.yaml, one after the other."""

from __future__ import annotations

import difflib
import reprlib
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from rgspipe.cli.compose import compose_config, leaves_machine
from rgspipe.cli.jobs import new_run_folder
from rgspipe.cli.leading import lead_on
from rgspipe.cli.messages import EXIT_FAILED
from rgspipe.cli.sweep_check import check_sweep
from rgspipe.datasets.input_file import input_file
from rgspipe.errors import InputError
from rgspipe.machine.resources import resource_folder
from rgspipe.plain_values import quoted
from rgspipe.program import typed
from rgspipe.store.status import read_statuses

#: What each step of a pipeline is run with.
RGSPIPE = (sys.executable, "-m", "rgspipe")

#: Bytes of the largest pipeline that is read.
MOST_BYTES = 2**20

#: Seconds after which a step that goes on is told of Ctrl-C once more.
PATIENCE = 10.0


@dataclass(frozen=True)
class SequenceStep:
    """One command of a pipeline: a stage, its overrides, and whether they are a sweep."""

    stage: str
    overrides: tuple[str, ...] = ()
    sweep: bool = False


def load_sequence(name: str) -> list[SequenceStep]:
    """The steps of a named pipeline, or of a YAML file.

    Raises:
        InputError: there is none, or it is not a list of steps.
    """
    folder = resource_folder("pipelines")
    given = name.endswith((".yaml", ".yml"))
    path = input_file(name, "the steps of a pipeline", most_bytes=MOST_BYTES) if given else folder / f"{name}.yaml"
    if not path.is_file():
        names = [file.stem for file in sorted(folder.glob("*.yaml"))]
        near = difflib.get_close_matches(name, names, n=1)
        remedy = f"Did you mean pipeline={near[0]}?" if near else "Or give a file: pipeline=FILE.yaml."
        raise InputError("pipeline", expected=f"one of {', '.join(names)}", found=repr(name), remedy=remedy)
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # also of dates and numbers that cannot be
        found = " ".join(str(error).split())
        raise InputError(path, expected="YAML", found=found, remedy="Correct the file.") from None
    steps = data.get("steps") if isinstance(data, dict) else None
    if not isinstance(steps, list) or not steps:
        remedy = "See docs/guides/add_setting.md for an example."
        raise InputError(path, expected="a list under 'steps'", found=type(data).__name__, remedy=remedy)
    return [_step(path, number, item) for number, item in enumerate(steps, 1)]


def _step(path: Path, number: int, item: Any) -> SequenceStep:
    where = f"{path}, step {number}"
    remedy = "A step is {stage: NAME, overrides: [key=value, ...], sweep: true or false}."
    if not isinstance(item, dict) or not isinstance(item.get("stage"), str):
        raise InputError(where, expected="a step with a stage", found=reprlib.repr(item), remedy=remedy)
    unknown = set(item) - {"stage", "overrides", "sweep"}
    overrides = item.get("overrides", [])
    if unknown or not isinstance(overrides, list) or not all(isinstance(text, str) for text in overrides):
        raise InputError(where, expected="stage, overrides and sweep", found=reprlib.repr(item), remedy=remedy)
    return SequenceStep(item["stage"], tuple(overrides), bool(item.get("sweep", False)))


def run_sequence(name: str, extra: Sequence[str], program: Sequence[str] = RGSPIPE) -> int:
    """Run a pipeline's commands, say where its results are and what usually comes next; stops at the first that fails.

    Args:
        name: a file under pipelines/, or the path of one.
        extra: overrides for every step, after its own.
        program: the command that understands a step's overrides.
    """
    steps = load_sequence(name)
    first = steps[0]
    config = check_sweep([f"stage={first.stage}", *first.overrides, *extra])
    folder = new_run_folder(Path(config.outputs), f"pipeline-{Path(name).stem}", elsewhere=not leaves_machine(extra))
    start, seconds, jobs = time.perf_counter(), [], []
    for number, step in enumerate(steps, 1):
        run_folder = folder / f"{number:02d}_{step.stage}"
        command = [*(["-m"] if step.sweep else []), f"stage={step.stage}", *step.overrides, *extra]
        print(f"[{number}/{len(steps)}] {typed(*command)}", flush=True)
        begin = time.perf_counter()
        key = "hydra.sweep.dir" if step.sweep else "hydra.run.dir"
        code = _run([*program, *command, f"{key}={quoted(str(run_folder))}"])
        seconds.append(time.perf_counter() - begin)
        if code != 0:
            print(f"Step {number} ({step.stage}) failed; see {run_folder}. What is done is kept.", file=sys.stderr)
            return code if code > 0 else EXIT_FAILED
        jobs = [status for _, status in read_statuses(run_folder)]
    _print_summary(steps, seconds, time.perf_counter() - start)
    for status in jobs:
        print(f"Result: {status['result']}")
    for status in jobs[-1:]:
        lead_on(compose_config(status["overrides"]), Path(status["result"]), status["overrides"])
    return 0


def _run(command: Sequence[str]) -> int:
    """The exit status of a command. Ctrl-C reaches it as well, and it may take its time to write down that it did."""
    with subprocess.Popen(command) as child:
        try:
            return child.wait()
        except KeyboardInterrupt:
            try:
                child.wait(PATIENCE)
            except subprocess.TimeoutExpired:  # only this process was told
                child.send_signal(signal.SIGINT)
                child.wait()
            raise


def _print_summary(steps: Sequence[SequenceStep], seconds: Sequence[float], total: float) -> None:
    for step, one in zip(steps, seconds, strict=True):
        print(f"  {one:8.1f} s  {step.stage} {' '.join(step.overrides)}".rstrip())
    print(f"  {total:8.1f} s  in all")
