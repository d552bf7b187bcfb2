"""Mitsuba 3 in a process of its own: a broken LLVM library takes that process down, and not the benchmark."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import rgspipe
from rgspipe.store.files import write_json

#: LLVM versions below crash on processors with AVX-512.
OLDEST_LLVM = 16

#: Where systems keep their libraries.
LIBRARY_FOLDERS = ("/usr/lib", "/usr/local/lib", "/opt/homebrew/opt/llvm/lib")

INSTALL_MITSUBA = "Mitsuba is not installed; install it: pip install 'rgspipe[bench]'"
INSTALL_LLVM = (
    f"no LLVM library of version {OLDEST_LLVM} or later was found; install one (Debian: apt-get install libllvm19), "
    "or name it in DRJIT_LIBLLVM_PATH"
)

REQUEST, RESULT = "request.npz", "result"
SETTINGS, FIGURES = "settings.json", "figures.json"

#: Seconds after which a worker that is still running is stopped.
PATIENCE = 3600.0


class PeerMissing(Exception):
    """Mitsuba cannot run here; the message says why, and what to do about it."""


def mitsuba_version() -> str:
    """The installed version.

    Raises:
        PeerMissing: there is none.
    """
    if importlib.util.find_spec("mitsuba") is None:
        raise PeerMissing(INSTALL_MITSUBA)
    return importlib.metadata.version("mitsuba")


def find_llvm() -> str:
    """Path of the LLVM library: DRJIT_LIBLLVM_PATH, or the newest that the system has.

    Raises:
        PeerMissing: there is none, or none that is new enough.
    """
    named = os.environ.get("DRJIT_LIBLLVM_PATH")
    if named:
        if not Path(named).exists():
            raise PeerMissing(f"DRJIT_LIBLLVM_PATH names no file: {named}")
        return named
    found = [path for folder in LIBRARY_FOLDERS for path in Path(folder).glob("**/libLLVM*") if _version(path)]
    newest = max(found, key=_version, default=None)
    if newest is None or _version(newest) < OLDEST_LLVM:
        raise PeerMissing(INSTALL_LLVM)
    return str(newest)


def _version(path: Path) -> int:
    """Major version in a library's name; 0 if it is no LLVM library."""
    match = re.fullmatch(r"libLLVM(?:-|\.so\.|\.)(\d+)(?:[.\d]*)(?:\.so[.\d]*|\.dylib)?", path.name)
    return int(match[1]) if match else 0


def ask_mitsuba(task: str, arrays: dict[str, np.ndarray], **settings: object) -> tuple[dict, dict[str, np.ndarray]]:
    """Have a child process do `task` ("render" or "rays") of `rgspipe.benchmark.mitsuba_worker`.

    Args:
        task: what to do.
        arrays: its input.
        settings: JSON values.

    Returns:
        figures (JSON values) and arrays.

    Raises:
        PeerMissing: Mitsuba or LLVM is missing or too old, or the child failed; with its last lines.
    """
    mitsuba_version()
    environment = os.environ | {"DRJIT_LIBLLVM_PATH": find_llvm(), "PYTHONPATH": _python_path()}
    with tempfile.TemporaryDirectory(prefix="rgspipe-mitsuba-") as name:
        folder = Path(name)
        np.savez(folder / REQUEST, **arrays)
        write_json(folder / SETTINGS, settings)
        command = [sys.executable, "-m", "rgspipe.benchmark.mitsuba_worker", task, name]
        try:
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, errors="replace", timeout=PATIENCE
            )
        except subprocess.TimeoutExpired as error:
            raise PeerMissing(f"Mitsuba had not finished after {PATIENCE:.0f} s") from error
        if done.returncode != 0:
            lines = " | ".join((done.stdout + done.stderr).strip().splitlines()[-3:])
            ending = f"was killed by signal {-done.returncode}" if done.returncode < 0 else "failed"
            raise PeerMissing(f"Mitsuba {ending} with {environment['DRJIT_LIBLLVM_PATH']}: {lines}")
        figures = json.loads((folder / FIGURES).read_text(encoding="utf-8"))
        return figures, {path.stem: np.load(path) for path in (folder / RESULT).glob("*.npy")}


def _python_path() -> str:
    """The child finds the package where we found it, however that was."""
    source = str(Path(rgspipe.__file__).resolve().parents[1])
    return os.pathsep.join([source, *filter(None, [os.environ.get("PYTHONPATH")])])
