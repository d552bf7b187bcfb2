"""What a simulated power cut takes: what `test_crash` and `make crash` rely on."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from faults import Fault
from power_cut import cut_power

#: Writes files as this package does, and as it must not.
WRITING = """
import os, sys
from pathlib import Path
from rgspipe.store.files import append_line, publish, write_text
root = Path(sys.argv[1])
write_text(root / "new" / "kept.txt", "kept")
append_line(root / "new" / "record", "kept")
(root / "partial").mkdir()
(root / "partial" / "kept.txt").write_text("kept")
publish(root / "partial", root / "published")
write_text(root / "former.txt", "kept")
(root / "lost.txt").write_text("lost")
(root / "half").write_text("lost")
(root / "half").rename(root / "renamed.txt")
(root / "other").write_text("lost")
(root / "other").replace(root / "former.txt")
"""

#: What is on the disk for good.
KEPT = {"new/kept.txt": "kept", "new/record": "\nkept", "published/kept.txt": "kept"}


@pytest.fixture
def cut(tmp_path: Path, child_environment: Mapping[str, str]) -> Callable[[random.Random | None], dict[str, str]]:
    """Files that are left after a power cut, with what they hold."""
    root, log, kept = tmp_path / "root", tmp_path / "log", tmp_path / "kept"
    root.mkdir()
    kept.mkdir()
    environment = Fault(str(log), str(kept)).environment(child_environment)
    subprocess.run([sys.executable, "-c", WRITING, str(root)], env=environment, check=True)

    def left(chance: random.Random | None) -> dict[str, str]:
        cut_power(root, log, chance)
        return {path.relative_to(root).as_posix(): path.read_text() for path in root.rglob("*") if path.is_file()}

    return left


def test_what_was_brought_to_the_disk_stays_and_nothing_else(cut) -> None:
    assert cut(None) == {**KEPT, "former.txt": "kept", "lost.txt": ""}


@pytest.mark.parametrize("seed", range(4))
def test_what_was_not_may_stay(cut, seed: int) -> None:
    left = cut(random.Random(seed))
    assert {name: left.get(name) for name in KEPT} == KEPT
    assert left.keys() <= {*KEPT, "former.txt", "lost.txt", "renamed.txt"}
    # Names are lost from the last one on.
    assert left["former.txt"] == "kept" or "renamed.txt" in left


def test_what_is_left_after_one_outlasts_the_next(cut) -> None:
    left = cut(random.Random(0))
    assert cut(None) == left
