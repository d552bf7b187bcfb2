"""Which files a .blend is made of: textures, libraries and caches that it names and does not pack.

Blender's own tracer of them reads the file, in a process of its own: it is not made for damaged files, which it may
follow without end. Blender itself is not needed.
"""

from __future__ import annotations

import functools
import glob
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from string import digits

from rgspipe.datasets.input_file import input_file

#: Seconds in which one file must have been traced. A file of 500 kB takes 0.1.
PATIENCE = 60.0

#: What stands for the number of a tile in the name of an image.
TILES = re.compile("<UDIM>|<UVTILE>")


@dataclass(frozen=True)
class BlendLinks:
    """What a .blend names, also by way of libraries.

    Attributes:
        files: itself, and what is there. A folder, such as the cache of a simulation, counts with all that is in it
            where it lies below that of the file.
        missing: what is not there.
        unknown: by file, why not all that it names can be told.
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
            if not _is_readable(name):
                missing[name] = None
            elif name not in found and _counts(name, path):
                found[name] = None
                open_ends += [name] if name.suffix == path.suffix else []
    return BlendLinks(tuple(found), tuple(missing), unknown)


def _is_readable(name: Path) -> bool:
    """Whether there is something that may be read: not in another user's folder, nor by a name that cannot be."""
    return os.access(name, os.R_OK)


def _counts(name: Path, path: Path) -> bool:
    return path.parent in name.parents if name.is_dir() else bool(input_file(name, f"a file that {path} names"))


def _traced(path: Path) -> tuple[list[Path], str]:
    """What one file names, and why not all of that can be told."""
    status = path.stat()
    names, why = _traced_once(path, status.st_mtime_ns, status.st_size)
    # Unlike `Path.resolve` this takes links that lead in circles.
    return [Path(os.path.realpath(one)) for name, sequence in names for one in _members(Path(name), sequence)], why


def _members(name: Path, sequence: bool) -> list[Path]:
    """The tiles or frames that are there, or the name itself; a folder is not opened, wherever it lies."""
    tiled = TILES.search(name.name) is not None
    if not sequence or not (tiled or _is_readable(name)) or name.is_dir() or not _is_readable(name.parent):
        return [name]
    if tiled:
        pattern = "*".join(glob.escape(part) for part in TILES.split(name.name))
    else:
        pattern = f"{glob.escape(name.stem.rstrip(digits))}*{glob.escape(name.suffix)}"
    return sorted(name.parent.glob(pattern)) or [name]


@functools.lru_cache(maxsize=64)
def _traced_once(path: Path, changed: int, size: int) -> tuple[list[tuple[str, bool]], str]:
    """As it was when it was changed last; plans ask again and again."""
    command = [sys.executable, "-m", "rgspipe.datasets.blend_trace", str(path)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    # Of a compressed file it makes a copy, which it cannot remove where it is stopped.
    with tempfile.TemporaryDirectory(prefix="rgspipe_blend_") as scratch:
        try:
            done = subprocess.run(command, env=environment | {"TMPDIR": scratch}, capture_output=True, timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            return [], f"it takes more than {PATIENCE:.0f} s"
    return json.loads(done.stdout) if done.returncode == 0 else ([], f"its reader ended with status {done.returncode}")
