"""Kills, power cuts and want of room at every call that publishes; on the whole way, `make crash` does it in full."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import toys
from crash_store import Store
from crash_world import REFUSED, Way, make_here
from power_cut import cut_power
from rgspipe.config import RgspipeConfig, with_changes
from whole_way import end_state

#: Seconds after which a run of toys is stuck; measured 0.1 s.
LONGEST = 60

TOYS = Way(with_changes(RgspipeConfig(), {"stage": "harvest", "dataset.resolution": 8, "report.views": [2]}), toys.load)

#: What happens at every fourth call, each beginning with another one, so that a run is disturbed at all of them.
KINDS = ("before", "refused", "power cut", "after")


@pytest.fixture(scope="module")
def place() -> Iterator[Path]:
    """A folder in memory where there is one: bringing things to a disk takes most of the time."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as folder:
        yield Path(folder)


@pytest.fixture(scope="module")
def undisturbed(place: Path) -> Store:
    """A store that is made in this process, then once more in another, whose calls are counted."""
    (place / "here").mkdir()
    make_here(TOYS, place / "here")
    store = Store(place / "undisturbed", place / "undisturbed.notes")
    assert store.run(TOYS).wait(LONGEST) == 0, store.told
    assert end_state(store.outputs) == end_state(place / "here" / "outputs")
    return store


@pytest.mark.parametrize("kind", KINDS)
def test_disturbed_at_any_call_it_ends_as_undisturbed(undisturbed: Store, place: Path, kind: str) -> None:
    expected, endings = end_state(undisturbed.outputs), set()
    for number in range(1 + KINDS.index(kind), undisturbed.calls + 1, len(KINDS)):
        store = Store(place / f"{number}", place / f"{number}.notes")
        status = store.run(TOYS, "before" if kind == "power cut" else kind, number).wait(LONGEST)
        endings.add(status)
        assert store.hit and "Traceback" not in store.told and (status != REFUSED or "room on the disk" in store.told)
        if kind == "power cut":
            cut_power(store.outputs, store.log)
        store.artifacts()
        assert store.run(TOYS).wait(LONGEST) == 0, store.told
        assert end_state(store.outputs) == expected, number
        store.remove()
    # What a run can do without, such as removing what it has renamed, may fail.
    assert endings == ({REFUSED, 0} if kind == "refused" else {-signal.SIGKILL})


@pytest.mark.slow
@pytest.mark.skipif(find_spec("bpy") is None, reason="bpy is not installed")
def test_the_whole_way_is_disturbed_a_few_times(child_environment: dict[str, str]) -> None:
    command = [sys.executable, str(Path(__file__).with_name("crash.py")), "10", "3"]
    done = subprocess.run(command, env=child_environment, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0, done.stdout + done.stderr
    cases, stuck, wrong, other = (int(word) for word in done.stdout.splitlines()[-1].split()[1:])
    assert cases >= 10 and not stuck + wrong + other
