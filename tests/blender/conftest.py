"""Running bpy in a process of its own."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def in_blender(child_environment: dict[str, str]) -> Callable[..., None]:
    """`in_blender(folder, "plane", "house")` runs measurements of in_blender.py or another script in one process.

    Skips without bpy.
    """
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("bpy is not installed")

    def run(folder: Path, *names: str, script: str = "in_blender.py") -> None:
        command = [sys.executable, str(Path(__file__).with_name(script)), str(folder), *names]
        done = subprocess.run(command, env=child_environment, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]

    return run
