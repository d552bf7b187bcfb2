"""A power cut, at its worst: what a run had not brought to the disk is gone, and so are names that were not.

    python tests/power_cut.py [CUTS]        (make crash)

makes the whole way on a tiny scene undisturbed, then again with power cuts at random moments, and compares the results.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import whole_way

SHIM = Path(__file__).resolve().parent / "power_cut_shim"


def noting(environment: Mapping[str, str], log: Path) -> dict[str, str]:
    """Environment of a run that notes in `log` what it brings to the disk."""
    paths = [str(SHIM), *filter(None, [environment.get("PYTHONPATH")])]
    return {**environment, "PYTHONPATH": os.pathsep.join(paths), "POWER_CUT_LOG": str(log)}


def cut_power(root: Path, log: Path) -> list[Path]:
    """Lose what the log does not know to be on the disk: names that were new, and the content of files; the paths."""
    events = [json.loads(line) for line in log.read_text().splitlines()] if log.is_file() else []
    lost = [path for path in _unnamed(events) if os.path.lexists(path) and path.is_relative_to(root)]
    for path in lost:
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)
    kept = {(event["inode"], event["size"], event["written"]) for event in events if event["kind"] == "file"}
    for path in (path for path in root.rglob("*") if path.is_file() and not path.is_symlink()):
        found = path.stat()
        if found.st_size and (found.st_ino, found.st_size, found.st_mtime_ns) not in kept:
            path.write_bytes(b"")
            lost.append(path)
    return lost


def _unnamed(events: Sequence[Mapping[str, object]]) -> list[Path]:
    """The new names whose folder was not brought to the disk after it had them."""
    last = {event["inode"]: number for number, event in enumerate(events) if event["kind"] == "folder"}
    return [
        Path(str(event["path"]))
        for number, event in enumerate(events)
        if event["kind"] == "rename" and event["new"] and last.get(event["folder"], -1) < number
    ]


def run_until(process: subprocess.Popen[bytes], seconds: float) -> bool:
    """Whether a process was still going on after so many seconds, and is killed with all that it has started."""
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return True
    return False


def main(cuts: int) -> int:
    """Cut the power so many times; the exit status."""
    paths = [str(Path(__file__).resolve().parents[1] / "src"), str(Path(__file__).resolve().parent)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    moments = random.Random(0)
    with tempfile.TemporaryDirectory() as place:
        undisturbed, disturbed = Path(place, "undisturbed"), Path(place, "disturbed")
        undisturbed.mkdir()
        disturbed.mkdir()
        begin = time.monotonic()
        whole_way.finish(undisturbed, environment)
        whole, log = time.monotonic() - begin, Path(place, "log")
        for number in range(1, cuts + 1):
            process = whole_way.start(disturbed, noting(environment, log))
            going = run_until(process, moments.uniform(0.1, 0.8) * whole)
            lost = [str(path.relative_to(disturbed / "outputs")) for path in cut_power(disturbed / "outputs", log)]
            print(f"cut {number}{'' if going else ' (all was made)'}: lost {', '.join(lost) or 'nothing'}", flush=True)
        whole_way.finish(disturbed, environment)
        same = whole_way.results(disturbed) == whole_way.results(undisturbed)
    print("The results are those of an undisturbed run." if same else "The results differ from an undisturbed run's.")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 4))
