"""A long sweep with random kills on one tiny scene: `make soak ARGS="JOBS KILLS SEED [slurm]"`.

The sweep is made undisturbed, then once more while all of it, or one of its workers, is killed now and then. Both must
end alike, byte for byte but for clocks, and the memory of driver and workers must not grow with the number of jobs.
With `slurm` the jobs go to a cluster of this machine, which goes on with them when the driver is killed.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from slurm.cluster import slurm_cluster
from whole_way import TINY, differences, end_state

#: Jobs at a time.
AT_ONCE = 8

#: How jobs are started.
LAUNCHERS = {
    "local": [f"hydra.launcher.n_jobs={AT_ONCE}"],
    "slurm": ["hydra/launcher=slurm", "hydra.launcher.cpus_per_task=1", "hydra.launcher.poll_s=0.3"],
}

#: Memory of the last third of a sweep over that of the second one, from which on it grows.
GROWN = 1.1

#: Seconds between two looks at the memory.
PAUSE = 0.5

SOURCE = Path(__file__).resolve().parents[1] / "src"


@dataclass
class Sweep:
    """A sweep that is going on in a folder, and the memory of its processes."""

    folder: Path
    process: subprocess.Popen[bytes]
    driver: list[int] = field(default_factory=list)
    worker: list[int] = field(default_factory=list)

    @classmethod
    def start(cls, folder: Path, jobs: int, launcher: Sequence[str], environment: Mapping[str, str]) -> Sweep:
        arguments = [f"{key}={value}" for key, value in {**TINY, "stage": "fit_light", "occlusion": "visible"}.items()]
        command = [sys.executable, "-m", "rgspipe", "-m", *arguments, f"seed=range({jobs})"]
        folder.mkdir(exist_ok=True)
        with (folder / "told").open("ab") as told:
            process = subprocess.Popen(
                [*command, *launcher], cwd=folder, stdin=subprocess.DEVNULL, stdout=told, stderr=told,
                env={**environment, "PYTHONPATH": str(SOURCE)}, start_new_session=True,
            )  # fmt: skip
        return cls(folder, process)

    def watch(self, until: Callable[[], bool] = lambda: False) -> int | None:
        """Note its memory until it ends, or something happens; its exit status, if it has ended."""
        while (status := self.process.poll()) is None and not until():
            workers = [resident(worker) for worker in self.workers()]
            self.driver.append(resident(self.process.pid))
            self.worker.append(max(workers, default=0))
            time.sleep(PAUSE)
        return status

    def workers(self) -> list[int]:
        """All of its processes but the one that drives it."""
        return [one for one in processes(self.folder.resolve()) if one != self.process.pid]

    def kill(self, draw: random.Random) -> None:
        """Kill all of it, or one of the processes that it has started."""
        workers = self.workers()
        with contextlib.suppress(ProcessLookupError):
            if workers and draw.random() < 0.5:
                os.kill(draw.choice(workers), signal.SIGKILL)
                self.watch()
            else:
                os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)


def processes(folder: Path) -> list[int]:
    """Processes that run in a folder, whoever has started them."""
    found = []
    for place in Path("/proc").glob("[0-9]*/cwd"):
        with contextlib.suppress(OSError):
            if place.readlink() == folder:
                found.append(int(place.parent.name))
    return sorted(found)


def resident(pid: int) -> int:
    """Resident memory of a process, bytes; 0 where it is gone."""
    with contextlib.suppress(OSError):
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0


def growth(values: list[int]) -> float:
    """The mean of the last third over that of the second one, in which every worker has begun."""
    third = max(1, len(values) // 3)
    second, last = values[third : 2 * third] or values, values[-third:]
    return (sum(last) / len(last)) / max(1.0, sum(second) / len(second))


def main(jobs: int, kills: int, seed: int, where: str) -> int:
    """Make the sweep twice; the exit status."""
    draw, launcher = random.Random(seed), LAUNCHERS[where]
    with contextlib.ExitStack() as stack:
        environment = stack.enter_context(slurm_cluster(AT_ONCE)) if where == "slurm" else dict(os.environ)
        place = stack.enter_context(tempfile.TemporaryDirectory())
        calm, wild = Path(place, "calm"), Path(place, "wild")
        begin, sweep = time.monotonic(), Sweep.start(calm, jobs, launcher, environment)
        ended = [sweep.watch()]
        whole = time.monotonic() - begin
        for name, values in (("driver", sweep.driver), ("largest worker", sweep.worker)):
            print(f"{name}: {max(values) / 2**20:.0f} MiB, last third over second one {growth(values):.3f}", flush=True)
        for number in range(kills):
            end = time.monotonic() + draw.uniform(0.0, 2.0 * whole / max(kills, 1))
            other = Sweep.start(wild, jobs, launcher, environment)
            if other.watch(lambda end=end: time.monotonic() > end) is None:
                other.kill(draw)
            made = len(list(wild.glob("outputs/*/fit_light/[0-9a-f]*")))
            print(f"kill {number + 1}: {made} of {jobs} fits are made", flush=True)
        ended.append(Sweep.start(wild, jobs, launcher, environment).watch())
        other = differences(end_state(wild / "outputs"), end_state(calm / "outputs"))
        told = (wild / "told").read_text(errors="replace")[-2000:]
    print(f"{jobs} jobs, {AT_ONCE} at a time, {kills} kills: ended with {ended}, other results: {other or 'none'}")
    grown = max(growth(sweep.driver), growth(sweep.worker)) > GROWN
    print(told if ended != [0, 0] else "Memory grows." if grown else "Memory stays flat.")
    return 1 if ended != [0, 0] or other or grown else 0


if __name__ == "__main__":
    places = [text for text in sys.argv[1:] if text in LAUNCHERS]
    given = [int(text) for text in sys.argv[1:] if text not in LAUNCHERS]
    sys.exit(main(*(given + [200, 20, 0][len(given) :]), *(places or ["local"])))
