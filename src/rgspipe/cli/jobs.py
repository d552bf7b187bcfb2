"""Runs and sweeps: one status file each, one failed job hides no other."""

from __future__ import annotations

import datetime
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import hydra
from hydra.conf import HydraConf
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from rgspipe.cli.compose import (
    CONFIG_NAME,
    HYDRA_VERSION_BASE,
    check_stage,
    compose_config,
    config_folder,
    given_folder,
    leaves_machine,
    register_schema,
    sweep_jobs,
    typed,
    usual_command,
)
from rgspipe.cli.leading import lead_on, lead_on_sweep
from rgspipe.cli.messages import EXIT_FAILED, EXIT_INPUT, EXIT_INTERRUPTED, show_failure, show_input_error
from rgspipe.cli.sweep_check import check_sweep
from rgspipe.cli.sweep_table import write_sweep_table
from rgspipe.errors import InputError
from rgspipe.graph.pipeline import Usual, run
from rgspipe.graph.resolver import StageLoader
from rgspipe.graph.variants import key_of
from rgspipe.plain_values import quoted
from rgspipe.progress import progress_of_job
from rgspipe.stages import load_stage
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import NO_RIGHT
from rgspipe.store.status import RunStatus, read_status, read_statuses, record_killed, record_stopped

#: What a run writes about itself: its configuration and how it ended.
RUN_BYTES = 2**16

#: Stages whose result is told in lines on the terminal.
TOLD = ("fit_light", "track", "evaluate")

#: Letters of the name of a job beside others; one that is longer leaves no room for its progress.
LONGEST_NAME = 40

#: What became of jobs of a sweep that was over before they began.
UNBEGUN = "did not begin, as the process of another job ended, and the sweep with it; mostly there was no memory left"


def run_jobs(overrides: Sequence[str], stage_loader: StageLoader, multirun: bool, leads_on: bool = True) -> int:
    """Run one configuration, or all of a sweep.

    Launchers are for sweeps, so that with launcher=slurm even a single run is one: of one job, on the cluster.

    Args:
        leads_on: whether this is all that was asked for, so that it is said which overrides have no effect, and at the
            end what usually comes next. A run or sweep whose folder is given is a step of something larger, as in a
            pipeline, and does not say the latter.

    Raises:
        InputError: an override cannot be used; nothing was started.
    """
    multirun = multirun or leaves_machine(overrides)
    config = check_sweep(overrides) if multirun else compose_config(overrides)
    if stage_loader is load_stage:
        check_stage(config.stage)
    mode = "sweep" if multirun else "run"
    folder = given_folder(overrides, mode) or given_folder(overrides, "run")
    is_all, leads_on = leads_on, leads_on and folder is None
    if folder is None:
        what = "sweep" if multirun else config.stage
        folder = new_run_folder(Path(config.outputs), what, elsewhere=not leaves_machine(overrides))
    else:
        _make(folder, f"hydra.{mode}.dir", exist_ok=True)
    # Said again even where it was given: interpolations such as the time must not be resolved twice.
    chosen = f"hydra.{mode}.dir={quoted(str(folder))}"
    # Worked out here: within a job Hydra composes nothing else.
    usual = usual_command(overrides, config, is_all)
    try:
        code = run_hydra([*(["-m"] if multirun else []), *overrides, chosen], stage_loader, usual)
    except KeyboardInterrupt:
        if multirun:  # jobs in processes of their own are killed before they can say so
            record_stopped(folder, EXIT_INTERRUPTED)
        raise
    if multirun:
        _record_unbegun(folder, sweep_jobs(overrides))
        return _sweep_summary(folder, code, overrides if leads_on else None)
    status = read_status(folder)
    code = max(code, EXIT_FAILED if status is None else int(status.get("exit_code", EXIT_FAILED)))
    if leads_on and code == 0:
        lead_on(config, Path(status["result"]), overrides)
    return code


def run_hydra(arguments: Sequence[str], stage_loader: StageLoader, usual: Usual | None = None) -> int:
    """Hand the arguments to Hydra as they are; its exit status, or the largest of jobs in this process."""

    codes = [0]
    found: list[str] = []

    # A closure, so that worker processes get the stage loader and what is usual with it.
    def job(values: DictConfig) -> int:
        codes.append(_job(values, stage_loader, usual, found))
        return codes[-1]

    register_schema()
    application = hydra.main(version_base=HYDRA_VERSION_BASE, config_path=config_folder(), config_name=CONFIG_NAME)(job)
    former = sys.argv
    sys.argv = ["rgspipe", *arguments]
    try:
        application()
    except SystemExit as error:
        return error.code if isinstance(error.code, int) else EXIT_FAILED
    finally:
        sys.argv = former
    # Not within the job: Hydra has words of its own for output that finds no room.
    for line in found:
        print(line)
    return max(codes)


def new_run_folder(outputs: Path, what: str, elsewhere: bool = True) -> Path:
    """Make outputs/runs/<time>_<what>, with a number if another run has the name.

    Args:
        outputs: the store.
        what: is run.
        elsewhere: whether a temporary folder will do where the store is there but may only be read: all that a run
            needs may be in it.

    Raises:
        InputError: no folder can be made there.
    """
    try:
        return _numbered(outputs, what)
    except InputError as error:
        cause = error.__cause__
        there = os.access(outputs, os.R_OK | os.X_OK)
        if not (elsewhere and there and isinstance(cause, OSError) and cause.errno in NO_RIGHT):
            raise
    folder = Path(tempfile.mkdtemp(prefix="rgspipe_run_"))
    print(f"{outputs} can only be read ({cause.strerror}): what is there is reused; status: {folder}", file=sys.stderr)
    return folder


def _numbered(outputs: Path, what: str) -> Path:
    stamp = datetime.datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    number = 1
    while True:
        folder = outputs / "runs" / f"{stamp}_{what}{f'_{number}' if number > 1 else ''}"
        try:
            _make(folder, "outputs", exist_ok=False)
        except FileExistsError:
            number += 1
        else:
            return folder


def _make(folder: Path, key: str, exist_ok: bool) -> None:
    """Make a folder that the setting `key` asks for."""
    try:
        folder.mkdir(parents=True, exist_ok=exist_ok)
        # Made is not yet written to: the disk may be full, and a folder that was there may be another user's.
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(RUN_BYTES))
    except OSError as error:
        if isinstance(error, FileExistsError) and folder.is_dir():
            raise
        raise InputError(
            key,
            expected="a folder that can be made and written to",
            found=f"{folder}: {error.strerror}",
            remedy=f"Give another one: {key}=FOLDER.",
        ) from error


def _job(values: DictConfig, stage_loader: StageLoader, usual: Usual | None, found: list[str]) -> int:
    """One run, or one job of a sweep; its exit status, and to `found` lines that say what a single run found."""
    settings = HydraConfig.get()
    overrides = list(settings.overrides.task)
    status = RunStatus.start(Path(settings.runtime.output_dir), str(values.get("stage")), overrides)
    wanted = bool(values.debug.traceback)
    try:
        config = typed(values)
        with progress_of_job(_name_beside_others(settings, usual)):
            artifact = run(config, stage_loader, overrides, usual)
    except InputError as error:
        status.failed(error, EXIT_INPUT)
        show_input_error(error, wanted)
        return EXIT_INPUT
    except Exception as error:
        status.failed(error, EXIT_FAILED)
        show_failure(error, status.path, wanted)
        return EXIT_FAILED
    except KeyboardInterrupt:
        status.stopped(EXIT_INTERRUPTED)
        raise
    except BaseException as error:
        status.failed(error, EXIT_FAILED)
        raise
    status.done(artifact.path)
    if settings.mode == RunMode.RUN:
        found += [*_outcome(artifact), f"Result: {artifact.path}"]
    return 0


def _name_beside_others(settings: HydraConf, usual: Usual | None) -> str:
    """What tells a job from those that run beside it, such as "scene=zoo views.count=3"; empty where none does."""
    if usual is None or settings.runtime.choices["hydra/launcher"] != "joblib" or settings.launcher.n_jobs == 1:
        return ""
    name = " ".join(text for text in settings.overrides.task if key_of(text) in usual.swept)
    return name if len(name) <= LONGEST_NAME else f"job {settings.job.num}"


def _outcome(artifact: Artifact) -> list[str]:
    """What a run found, in lines; none of stages that look for no lights."""
    if artifact.stage not in TOLD:
        return []
    # It reads tables and tensors, which other runs need not wait for.
    from rgspipe.cli.outcome import outcome

    return outcome(artifact)


def _record_unbegun(folder: Path, jobs: Sequence[Sequence[str]]) -> None:
    """Say of jobs of a sweep that never began that they were killed, where others did and folders are called as usual.

    Where none began nothing took them along: the sweep itself was refused.
    """
    begun = [path for path, _ in read_statuses(folder)]
    if 0 < len(begun) < len(jobs) and all(path.parent == folder and path.name.isdecimal() for path in begun):
        for number, overrides in enumerate(jobs):
            if folder / str(number) not in begun:
                record_killed(folder / str(number), overrides, UNBEGUN)


def _sweep_summary(folder: Path, code: int, overrides: Sequence[str] | None) -> int:
    """Print how each job ended, gather their tables into one, and say what comes next; the largest exit status.

    Args:
        overrides: of the sweep, for what comes next; None where that is not said.
    """
    jobs = read_statuses(folder)
    for path, status in jobs:
        state = "killed" if status["state"] in ("killed", "running") else status["state"]
        print(f"  job {path.name}: {state:<6} {' '.join(status['overrides'])}  {status.get('result', '')}".rstrip())
        if state != "done":
            print(f"    see {path / 'status.json'}")
    failed = [status for _, status in jobs if status["state"] != "done"]
    print(f"{len(jobs) - len(failed)} of {len(jobs)} jobs done; {folder}")
    if not jobs:
        return max(code, EXIT_FAILED)
    table = write_sweep_table(folder, jobs)
    print(f"Table: {table}")
    if overrides is not None and not failed and code == 0:
        lead_on_sweep(overrides, jobs, table)
    return max([code, *(int(status.get("exit_code", EXIT_FAILED)) for status in failed)])
