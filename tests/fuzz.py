"""Mutants of every kind of file that is read, as many as are asked for: `make fuzz ARGS="CASES SEED"`.

Each worker may have 1 GiB more than it begins with, and each mutant 5 s of its processor, or a minute of waiting. What
is neither read, with finite numbers, nor refused by an error that names the file is kept in fuzz_found/ with what
happened. Exit status 1 if anything was.
"""

from __future__ import annotations

import random
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import FrameType

import torch

from mutants import mutated, names_place
from readable_files import KINDS, fresh
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar

#: Seconds of the processor for a mutant, seconds by the clock where other programs run, and memory of a worker beyond
#: what it begins with.
LONGEST, PATIENCE, MEMORY = 5, 60, 2**30

#: Mutants that a worker reads at a time.
BATCH = 250

#: Where what fell is kept.
FOUND = Path("fuzz_found")


def main(cases: int, seed: int) -> int:
    """Read so many mutants, spread over all kinds."""
    each = -(-cases // len(KINDS))
    batches = [(name, seed, first, min(BATCH, each - first)) for name in KINDS for first in range(0, each, BATCH)]
    counts: dict[str, Counter[str]] = {name: Counter() for name in KINDS}
    with ProcessPoolExecutor(initializer=_limited) as pool:
        waiting = [(batch, pool.submit(_batch, *batch)) for batch in batches]
        for (name, *rest), found in progress_bar(waiting, "reading mutants", unit="batch"):
            try:
                counts[name] += found.result()
            except BrokenProcessPool:
                print(f"{name}: the process died in the batch {rest} or one beside it")
                counts[name]["fell"] += 1
    print(f"{'kind':22}{'mutants':>9}{'read':>9}{'refused':>9}{'fell':>6}")
    for name, count in {**counts, "all": sum(counts.values(), Counter())}.items():
        print(f"{name:22}{count.total():9}{count['read']:9}{count['refused']:9}{count['fell']:6}")
    return 1 if any(count["fell"] for count in counts.values()) else 0


def _limited() -> None:
    torch.set_num_threads(1)
    begun = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (begun + MEMORY, resource.RLIM_INFINITY))
    for number in (signal.SIGALRM, signal.SIGPROF):
        signal.signal(number, _too_long)


def _too_long(number: int, frame: FrameType | None) -> None:
    raise TimeoutError(f"longer than {LONGEST} s of the processor, or {PATIENCE} s")


def _batch(name: str, seed: int, first: int, count: int) -> Counter[str]:
    """Read mutants `first` to `first + count` of a kind."""
    kind, found = KINDS[name], Counter()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "case"
        content = fresh(kind, folder)
        for mutant in _mutants(content, name, seed, first, count):
            (folder / kind.file).write_bytes(mutant)
            found[_outcome(name, folder, mutant)] += 1
    return found


def _mutants(content: bytes, name: str, seed: int, first: int, count: int) -> Iterator[bytes]:
    for index in range(first, first + count):
        yield mutated(content, random.Random(f"{name} {seed} {index}"))


def _outcome(name: str, folder: Path, mutant: bytes) -> str:
    """read, refused or fell; what fell is kept."""
    kind = KINDS[name]
    signal.alarm(PATIENCE)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        if all(bool(tensor.isfinite().all()) for tensor in kind.read(folder)):
            return "read"
        story = "numbers that are not finite were let through"
    except InputError as error:
        if names_place(str(error), str(folder)):
            return "refused"
        story = f"an error that does not name the file: {error}"
    except BaseException:  # whatever else happens is what is looked for
        story = traceback.format_exc()
    finally:
        signal.alarm(0)
        signal.setitimer(signal.ITIMER_PROF, 0)
    FOUND.mkdir(exist_ok=True)
    stem = f"{re.sub('[^a-z0-9]+', '_', name.lower())}_{time.monotonic_ns()}"
    (FOUND / f"{stem}.txt").write_text(story)
    (FOUND / f"{stem}{Path(kind.file).suffix}").write_bytes(mutant)
    return "fell"


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*(given + [20_000, 0][len(given) :])))
