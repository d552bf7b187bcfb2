"""Which files a .blend is made of: textures, libraries and caches that it names and does not pack.

Blender's own tracer of them reads the file, in a process of its own: it is not made for damaged files, which it may
follow without end. Blender itself is not needed.
"""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from blender_asset_tracer.trace.file_sequence import expand_sequence

from rgspipe.datasets.input_file import input_file

#: Seconds in which one file must have been traced. A file of 500 kB takes 0.3.
PATIENCE = 60.0


@dataclass(frozen=True)
class BlendLinks:
    """What a .blend names, also by way of libraries.

    Attributes:
        files: itself, and what is there. A folder, such as the cache of a simulation, counts with all that is in it
            where it lies below that of the file.
        missing: what is not there.
        unknown: by file, why it cannot be told what it names.
    """

    files: tuple[Path, ...]
    missing: tuple[Path, ...]
    unknown: dict[Path, str]


def blend_links(path: Path) -> BlendLinks:
    """Trace what belongs to a .blend file.

    Raises:
        InputError: it, or a file that it names, is no regular file.
    """
    path = input_file(path, "a .blend file").resolve()
    found, missing, unknown, open_ends = {path: None}, {}, {}, [path]
    while open_ends:
        names, why = _traced(place := open_ends.pop())
        if why:
            unknown[place] = why
        for name in names:
            if not name.exists():
                missing[name] = None
            elif name not in found and _counts(name, path):
                found[name] = None
                open_ends += [name] if name.suffix == path.suffix else []
    return BlendLinks(tuple(found), tuple(missing), unknown)


def _counts(name: Path, path: Path) -> bool:
    return path.parent in name.parents if name.is_dir() else bool(input_file(name, f"a file that {path} names"))


def _traced(path: Path) -> tuple[list[Path], str]:
    """What one file names, or why that cannot be told."""
    status = path.stat()
    traced = _traced_once(path, status.st_mtime_ns, status.st_size)
    if isinstance(traced, str):
        return [], traced
    return [one.resolve() for name, sequence in traced for one in _members(Path(name), sequence)], ""


def _members(name: Path, sequence: bool) -> list[Path]:
    """The tiles or frames that are there, or the name itself; a folder is not opened, wherever it lies."""
    if not sequence or name.is_dir():
        return [name]
    try:
        return list(expand_sequence(name)) or [name]
    except OSError:  # not there
        return [name]


@functools.lru_cache(maxsize=64)
def _traced_once(path: Path, changed: int, size: int) -> list[tuple[str, bool]] | str:
    """As it was when it was changed last; plans ask again and again."""
    command = [sys.executable, "-m", "rgspipe.datasets.blend_trace", str(path)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return f"it takes more than {PATIENCE:.0f} s"
    return json.loads(done.stdout) if done.returncode == 0 else f"its reader ended with status {done.returncode}"
