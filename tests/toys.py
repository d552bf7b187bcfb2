"""Small real stages to test the graph, the store and the command line with, and a command line that runs them.

`sow` writes one file for each row, slowly, and goes on after an interruption; `grow` sums them up; `harvest` needs
`grow` for several numbers of views. `break` fails with some seeds; `gather` takes what `after` made of it with several,
and goes on without those that failed.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import time

from rgspipe.cli import main
from rgspipe.config import RgspipeConfig
from rgspipe.datasets.reading_limits import reading_limits
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar
from rgspipe.stages.base import Failure, Need, Stage, StageContext
from rgspipe.store.files import replacing, write_text
from rgspipe.store.whole_files import WholeFiles

PAUSE_VARIABLE = "TOY_PAUSE"

#: The seed with which `break` finds the disk full, and those that `gather` takes.
FULL, GATHERED = 7, (5, 1, 6, 2)


def _sow(context: StageContext) -> None:
    pause, whole = float(os.environ.get(PAUSE_VARIABLE, "0")), WholeFiles(context.folder)
    for row in range(context.config.dataset.resolution):
        path = context.folder / f"row_{row:02d}.txt"
        if whole.keeps(path):
            continue
        with replacing(path) as temporary, temporary.open("w") as stream:
            for column in range(4):
                stream.write(f"{row * 4 + column}\n")
                stream.flush()
                time.sleep(pause / 4)
        whole.add(path)
    context.note(rows=context.config.dataset.resolution)
    with (context.folder.parent / "made.log").open("a") as log:
        log.write(f"{os.getpid()}\n")


def _grow(context: StageContext) -> None:
    seeds = context.inputs["sow"]
    rows = [seeds.file(name).read_text().split() for name in sorted(seeds.manifest["files"])]
    total = sum(int(number) for row in rows for number in row)
    write_text(context.folder / "total.txt", f"{total * context.config.views.count}\n")
    context.note(threads=os.environ.get("OMP_NUM_THREADS"), spinning=os.environ.get("OMP_WAIT_POLICY"))
    context.note(pixels=reading_limits().pixels, progress=progress_bar([], "adding").desc)


def _harvest(context: StageContext) -> None:
    grown = context.input_lists["grow"]
    (context.folder / "totals.txt").write_text("".join(item.file("total.txt").read_text() for item in grown))


def _break(context: StageContext) -> None:
    if context.config.seed == 1:
        raise RuntimeError("seed 1 breaks\nin two lines")
    if context.config.seed == 2:
        raise InputError("seed", expected="another one", found="2", remedy="Choose another.")
    if context.config.seed == 3:
        os._exit(9)
    if context.config.seed == FULL:
        raise OSError(errno.ENOSPC, "no space left")
    (context.folder / "seed.txt").write_text(f"{context.config.seed}\n")


def _after(context: StageContext) -> None:
    write_text(context.folder / "seed.txt", context.inputs["break"].file("seed.txt").read_text())


def _gather(context: StageContext) -> None:
    lines = [
        f"{found.stage}: {found.reason}\n" if isinstance(found, Failure) else found.file("seed.txt").read_text()
        for found in context.attempts("after", len(GATHERED))
    ]
    write_text(context.folder / "gathered.txt", "".join(lines))


def _crunch(context: StageContext) -> None:
    (context.folder / "begun.txt").write_text("begun\n")
    # A long call into native code, which hears signals when it is over.
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    time.sleep(1.5)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    time.sleep(60.0)


def _seeds(config: RgspipeConfig) -> list[Need]:
    return [Need("after", {"seed": seed}, may_fail=True) for seed in GATHERED]


def _views(config: RgspipeConfig) -> list[Need]:
    return [Need("grow", {"views.count": count}) for count in config.report.views]


SOW = Stage("sow", "writes rows", _sow, config_keys=("dataset.resolution",))
GROW = Stage("grow", "adds them up", _grow, inputs=lambda config: ["sow"], config_keys=("views",))
HARVEST = Stage("harvest", "brings it in", _harvest, inputs=_views)
BREAK = Stage("break", "fails on some seeds", _break, config_keys=("seed",))
AFTER = Stage("after", "takes what broke or not", _after, inputs=lambda config: ["break"])
GATHER = Stage("gather", "takes what there is", _gather, inputs=_seeds)
CRUNCH = Stage("crunch", "is busy", _crunch, config_keys=("seed",))

STAGES = {stage.name: stage for stage in (SOW, GROW, HARVEST, BREAK, AFTER, GATHER, CRUNCH)}


def load(name: str) -> Stage:
    """The toy stage of this name."""
    if name not in STAGES:
        raise InputError("stage", expected=f"one of {', '.join(STAGES)}", found=repr(name), remedy="Choose one.")
    return STAGES[name]


if __name__ == "__main__":
    # Imported by its name, so that worker processes find the stages under it too.
    import toys

    sys.exit(main(sys.argv[1:], toys.load))
