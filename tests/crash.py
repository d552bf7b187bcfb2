"""Kills, power cuts, full disks while the whole way is made on a tiny scene: `make crash ARGS="CASES SEED"`.

A store is disturbed again and again until it is whole, then the next one. Each must end as one that nobody disturbed,
byte for byte but for clocks. Exit status 1 if any does not, if a run is stuck, or ends in any way but as it should.
Change no code meanwhile: other code makes other artifacts.
"""

from __future__ import annotations

import os
import random
import sys
import time
from collections import Counter

import torch

from crash_kinds import LONGEST, Disturbances, Whole
from crash_store import Store
from crash_world import Run, User, Way, adopt, make_here
from disk import Disk, go_apart, own_disk
from rgspipe.cli.compose import compose_config
from rgspipe.stages import load_stage
from whole_way import ARGUMENTS, differences, end_state

#: How far a run comes until it is disturbed, at most, as a share of the whole; twice as far after no progress.
STRETCH = 1 / 40

#: Every so many stores are made from nothing, by two members of a group in turn, and by several processes at once.
#: The others begin with the images, as Blender takes as long to start as three stages; and it may not be there for all
#: users.
NEW, SHARED, CROWDED = "new", "two users", "six at once"
EVERY = {NEW: 3, SHARED: 4, CROWDED: 5}
USERS, AT_ONCE = (User(65534, 65534), User(65533, 65534)), 6

#: What the others begin with.
GIVEN = ("generate_dataset", "true_surfels")

#: Names that are shown of a store that ended otherwise.
SHOWN = 10

#: Disturbances that went wrong, after which there is no use in going on.
ENOUGH = 20


class Crashes:
    """Disturbs runs of a way on a disk, and remembers what came of it.

    Attributes:
        cases, stuck, wrong, other: by kind, how many runs were disturbed; did not end; ended in another way than they
            must; belong to a store that ended in another way.
    """

    def __init__(self, way: Way, disk: Disk, seed: int) -> None:
        self._way, self._disk, self._draw = way, disk, random.Random(seed)
        self.cases, self.stuck, self.wrong, self.other = (Counter[str]() for _ in range(4))
        adopt()
        self._undisturbed = self._store("undisturbed")
        self._whole = whole = self._measured()
        self._expected = end_state(self._undisturbed.outputs)
        self._kinds = Disturbances(way, whole, disk, self._draw).kinds()
        print(f"Undisturbed: {whole.calls} calls that publish, {whole.seconds:.1f} s, {len(self._expected)} names")

    def disturb(self, cases: int) -> None:
        """Disturb runs so many times."""
        number = 0
        while self.cases.total() < cases and (self.stuck + self.wrong + self.other).total() < ENOUGH:
            number += 1
            shared = number % EVERY[SHARED] == 0 and os.geteuid() == 0
            store = self._store(f"{number}", USERS if shared else ())
            if shared or number % EVERY[NEW]:
                store.begin_with([place for name in GIVEN for place in self._undisturbed.outputs.glob(f"*/{name}")])
            if number % EVERY[CROWDED] == 0:
                self._crowd(store)
            else:
                self._until_whole(store, cases)
            self._finish(store)

    def table(self) -> str:
        """What came of it, a row a kind."""
        lines = [f"{'disturbed':22}{'cases':>7}{'stuck':>7}{'wrong':>7}{'other result':>14}"]
        counts = (self.cases, self.stuck, self.wrong, self.other)
        for kind in [*sorted(sum(counts, Counter())), "all"]:
            row = [count.total() if kind == "all" else count[kind] for count in counts]
            lines.append(f"{kind:22}{row[0]:7}{row[1]:7}{row[2]:7}{row[3]:14}")
        return "\n".join(lines)

    def _measured(self) -> Whole:
        """What the whole takes, made twice: here, and in a process forked from here, as all others will be."""
        make_here(self._way, self._undisturbed.folder)
        again, begin = self._store("again"), time.monotonic()
        assert again.run(self._way).wait(LONGEST) == 0, again.told
        seconds, calls = time.monotonic() - begin, again.calls
        other = differences(end_state(again.outputs), end_state(self._undisturbed.outputs))
        assert not other, other
        size = sum(path.stat().st_size for path in again.outputs.rglob("*") if path.is_file())
        again.remove()
        return Whole(calls, seconds, size)

    def _until_whole(self, store: Store, cases: int) -> None:
        """Disturb runs until one ends by itself, or there were cases enough."""
        far = STRETCH
        while self.cases.total() < cases:
            before, begin = store.artifacts(), time.monotonic()
            (kind,) = self._draw.choices(list(self._kinds), [weight for weight, _ in self._kinds.values()])
            shown = SHARED if store.users else kind
            try:
                ending = self._kinds[kind][1](store, far)
            except TimeoutError:
                self.stuck[shown] += 1
                return
            if ending.disturbed:
                store.suffered[shown] += 1
                self.cases[shown] += 1
                place = f"{kind} {store.hit}".strip()
                print(f"{self.cases.total():4}: store {store.folder.name}, {place}, {time.monotonic() - begin:.1f} s")
            if ending.wrong is not None:
                self.wrong[shown] += 1
                print(f"  ended with {ending.wrong}: {store.told}")
            if not ending.disturbed or ending.wrong is not None:
                return
            far = STRETCH if store.artifacts() > before else min(1.0, 2.0 * far)

    def _crowd(self, store: Store) -> None:
        """Several runs at once, half of which are killed at some instant."""
        whole = self._whole.seconds
        seconds = [self._draw.choice((self._draw.uniform(0, whole), LONGEST)) for _ in range(AT_ONCE)]
        runs = [Run.start(self._way, store.folder, store.notes / f"told_{index}") for index in range(AT_ONCE)]
        begin = time.monotonic()
        for moment, run in sorted(zip(seconds, runs, strict=True), key=lambda pair: pair[0]):
            try:
                status = run.kill_after(max(0.0, moment - (time.monotonic() - begin)), LONGEST)
            except TimeoutError:
                self.stuck[CROWDED] += 1
                continue
            self.cases[CROWDED] += status == -9
            store.suffered[CROWDED] += status == -9
            if status not in (0, -9):
                self.wrong[CROWDED] += 1
                print(f"  ended with {status}: {run.told.read_text()}")
        print(f"{self.cases.total():4}: store {store.folder.name}, {CROWDED}, {time.monotonic() - begin:.1f} s")

    def _finish(self, store: Store) -> None:
        """Make what is missing, undisturbed, and compare."""
        try:
            status = store.run(self._way).wait(LONGEST)
        except TimeoutError:
            self.stuck["the run afterwards"] += 1
            return
        other = differences(end_state(store.outputs), self._expected)
        if status == 0 and not other:
            store.remove()
            return
        self.other += store.suffered or Counter(["none"])
        print(f"  store {store.folder.name} ended with {status}; other than undisturbed: {', '.join(other[:SHOWN])}")
        if status:
            print(store.told)

    def _store(self, name: str, users: tuple[User, ...] = ()) -> Store:
        return Store(self._disk.root / name, self._disk.notes / name, users)


def main(cases: int, seed: int) -> int:
    """Disturb so many runs; the exit status."""
    sys.stdout.reconfigure(line_buffering=True)
    # Processes are forked once torch is at work: it bears that with one thread, and without a GPU.
    torch.set_num_threads(1)
    os.environ |= {"OMP_NUM_THREADS": "1", "CUDA_VISIBLE_DEVICES": ""}
    with own_disk() as disk:
        crashes = Crashes(Way(compose_config(ARGUMENTS), load_stage), disk, seed)
        crashes.disturb(cases)
    print(crashes.table())
    return 1 if (crashes.stuck + crashes.wrong + crashes.other).total() else 0


if __name__ == "__main__":
    go_apart()
    given = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*(given + [500, 0][len(given) :])))
