"""OpenEXR files of Blender's process, with the functions of `datasets.exr`.

An installed Blender holds an OpenEXR of its own, and calls inside the one of our packages would end up in it, and the
process with them. There another process of Blender's Python reads and writes, and arrays pass through files.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from rgspipe.datasets import exr

#: Whether this is a program, not the module.
INSTALLED = bool(bpy.app.binary_path)


def read_channels(path: Path) -> dict[str, np.ndarray]:
    """`datasets.exr.read_channels`."""
    if not INSTALLED:
        return exr.read_channels(path)
    with tempfile.NamedTemporaryFile(suffix=".npz") as arrays:
        _ask("read", path, arrays.name)
        return dict(np.load(arrays.name))


def write_channels(path: Path, channels: dict[str, np.ndarray]) -> None:
    """`datasets.exr.write_channels`."""
    if not INSTALLED:
        exr.write_channels(path, channels)
        return
    with tempfile.NamedTemporaryFile(suffix=".npz") as arrays:
        np.savez(arrays.name, **channels)
        _ask("write", path, arrays.name)


def write_image(path: Path, image: np.ndarray, alpha: np.ndarray) -> None:
    """`datasets.exr.write_image`: RGB (H, W, 3) and alpha (H, W)."""
    write_channels(path, {"R": image[..., 0], "G": image[..., 1], "B": image[..., 2], "A": alpha})


@cache
def _process() -> subprocess.Popen:
    """Ends with this one, when nothing more can come through its pipe."""
    command = [sys.executable, str(Path(__file__).with_name("exr_process.py"))]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _ask(*request: Any) -> None:
    process = _process()
    process.stdin.write(json.dumps([str(part) for part in request]) + "\n")
    process.stdin.flush()
    answer = process.stdout.readline()
    if answer != "done\n":
        raise RuntimeError(f"{request[0]} {request[1]}: {answer.strip() or 'the process that does it has ended'}")
