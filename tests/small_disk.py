"""A small disk for a child process, where the system lets its users mount one."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

#: Runs a command with mounts of its own, as the root of a world of its own.
APART = ("unshare", "--map-root-user", "--mount")


def on_small_disk(
    folder: Path, size: str, script: str, environment: Mapping[str, str], words: Sequence[str] = ()
) -> subprocess.CompletedProcess[str]:
    """Run a shell script to which `folder` is an empty disk of `size`; `words` are its $1, $2 and so on."""
    mount = f"mount -t tmpfs -o size={size} none '{folder}'"
    if subprocess.run([*APART, "sh", "-c", mount], capture_output=True).returncode != 0:
        pytest.skip("this system lets nobody mount a small disk")
    command = [*APART, "sh", "-c", f"{mount} && {script}", "sh", *words]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
