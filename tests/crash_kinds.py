"""What can befall a run of a store, and how such a run must end."""

from __future__ import annotations

import random
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from crash_store import Store
from crash_world import REFUSED, Way
from disk import Disk
from power_cut import cut_power

#: Seconds after which a run is stuck.
LONGEST = 600

#: How often power is cut at a call rather than at an instant, and takes all that it can.
AT_CALL, WORST = 0.7, 0.3

#: Room on a full disk, at most, as a share of the store for each share of the way that a run may come.
ROOM = 4.0


@dataclass(frozen=True)
class Whole:
    """What an undisturbed run takes: calls that publish, seconds, bytes."""

    calls: int
    seconds: float
    bytes: int


@dataclass(frozen=True)
class Ending:
    """How a run ended: whether it was disturbed, and if not as it must, with what exit status."""

    disturbed: bool
    wrong: int | None = None


@dataclass(frozen=True)
class Disturbances:
    """Disturbs runs of a way.

    Attributes:
        way, whole: what is made, and what that takes.
        disk: where.
        draw: decides when.
    """

    way: Way
    whole: Whole
    disk: Disk
    draw: random.Random

    def kinds(self) -> Mapping[str, tuple[int, Callable[[Store, float], Ending]]]:
        """By name, how often it is chosen, and what does it to a run that comes at most so far, as a share."""
        found = {
            "killed before a call": (4, lambda store, far: _killed(self._at_call(store, far, "before"))),
            "killed after a call": (3, lambda store, far: _killed(self._at_call(store, far, "after"))),
            "killed at an instant": (4, lambda store, far: _killed(self._at_instant(store, far))),
            "power cut": (6, self._power_cut),
            "no room for a call": (2, lambda store, far: _refused(store, self._at_call(store, far, "refused"))),
        }
        return found | ({"disk full": (2, self._disk_full)} if self.disk.small else {})

    def _at_call(self, store: Store, far: float, kind: str) -> int:
        number = self.draw.randint(1, max(1, round(far * self.whole.calls)))
        return store.run(self.way, kind, number).wait(LONGEST)

    def _at_instant(self, store: Store, far: float) -> int:
        return store.run(self.way).kill_after(self.draw.uniform(0, far * self.whole.seconds), LONGEST)

    def _power_cut(self, store: Store, far: float) -> Ending:
        side = self.draw.choice(("before", "after"))
        status = self._at_call(store, far, side) if self.draw.random() < AT_CALL else self._at_instant(store, far)
        if status == -signal.SIGKILL:
            cut_power(store.outputs, store.log, None if self.draw.random() < WORST else self.draw)
        return _killed(status)

    def _disk_full(self, store: Store, far: float) -> Ending:
        with self.disk.nearly_full(round(self.draw.uniform(0, ROOM * far) * self.whole.bytes)):
            return _refused(store, store.run(self.way).wait(LONGEST))


def _killed(status: int) -> Ending:
    return Ending(status == -signal.SIGKILL, None if status in (0, -signal.SIGKILL) else status)


def _refused(store: Store, status: int) -> Ending:
    """A run that finds no room says so in a sentence; what it can do without, it does without."""
    if status == 0:
        return Ending(bool(store.hit))
    told = " ".join(store.told.split())
    right = status == REFUSED and "room on the disk" in told and "Traceback" not in told
    return Ending(True, None if right else status)
