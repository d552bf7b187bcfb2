"""After a power cut at any moment the next run ends as an undisturbed one; `make crash` does it in full."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import toys
from power_cut import cut_power, noting, run_until

#: Writes files as this package does, and as it must not.
WRITING = """
import os, sys
from pathlib import Path
from rgspipe.files import append_line, publish, write_text
root = Path(sys.argv[1])
write_text(root / "new" / "kept.txt", "kept")
append_line(root / "new" / "record", "kept")
(root / "partial").mkdir()
(root / "partial" / "kept.txt").write_text("kept")
publish(root / "partial", root / "published")
(root / "lost.txt").write_text("lost")
(root / "half").write_text("lost")
(root / "half").rename(root / "renamed.txt")
"""

HARVEST = """
import sys, toys
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.pipeline import run
run(with_changes(RgspipeConfig(), {"stage": "harvest", "outputs": sys.argv[1], "dataset.resolution": 8}), toys.load)
"""


def test_what_was_brought_to_the_disk_stays_and_nothing_else(
    tmp_path: Path, child_environment: Mapping[str, str]
) -> None:
    root, log = tmp_path / "root", tmp_path / "log"
    root.mkdir()
    subprocess.run([sys.executable, "-c", WRITING, str(root)], env=noting(child_environment, log), check=True)
    assert set(cut_power(root, log)) == {root / "lost.txt", root / "renamed.txt"}
    left = {path.relative_to(root).as_posix(): path.read_text() for path in root.rglob("*") if path.is_file()}
    assert left == {
        "new/kept.txt": "kept", "new/record": "\nkept", "published/kept.txt": "kept", "lost.txt": ""
    }  # fmt: skip


def test_runs_after_power_cuts_end_as_an_undisturbed_one(tmp_path: Path, child_environment: Mapping[str, str]) -> None:
    environment = {**noting(child_environment, tmp_path / "log"), toys.PAUSE_VARIABLE: "0.3"}
    command = [sys.executable, "-c", HARVEST]
    subprocess.run([*command, str(tmp_path / "undisturbed")], env=child_environment, check=True)
    moments, cut = random.Random(4), 0
    for _ in range(10):
        process = subprocess.Popen([*command, str(tmp_path / "cut")], env=environment, start_new_session=True)
        cut += run_until(process, 0.3 + 0.9 * moments.random())
        cut_power(tmp_path / "cut", tmp_path / "log")
    assert cut >= 3
    subprocess.run([*command, str(tmp_path / "cut")], env=child_environment, check=True)
    assert _contents(tmp_path / "cut") == _contents(tmp_path / "undisturbed")


def _contents(outputs: Path) -> dict[str, bytes]:
    """The files of every artifact, but for its manifest, which knows the time."""
    files = [path for path in outputs.glob("cornell/*/[0-9a-f]*/*") if path.name != "manifest.json"]
    links = [path for path in outputs.glob("cornell/*/latest*") if path.is_symlink()]
    found = {path.relative_to(outputs).as_posix(): path.read_bytes() for path in files}
    return found | {path.relative_to(outputs).as_posix(): str(path.readlink()).encode() for path in links}
