"""Kernels run wherever some folder can be written to; else that is said, before a compiler ends the process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from small_disk import on_small_disk

#: A kernel that is compiled, and where it is kept; or what is said instead.
RUN = """
import logging, warp as wp
logging.basicConfig(format="%(message)s")
from rgspipe.errors import InputError
try:
    from rgspipe.renderer.kernels import reciprocity
except InputError as error:
    print(error)
else:
    print("started", wp.config.kernel_cache_dir)
    wp.get_module("rgspipe.renderer.kernels.reciprocity").load(wp.get_device("cpu"), block_dim=1)
    print("compiled")
"""


def test_kernels_are_compiled_where_no_folder_can_be_kept(child_environment: dict[str, str]) -> None:
    """The process ended with a traceback of Warp."""
    environment = child_environment | {"WARP_CACHE_PATH": "/proc/none"}
    done = subprocess.run([sys.executable, "-c", RUN], env=environment, capture_output=True, text=True, timeout=300)
    assert "compiled" in done.stdout and "WARP_CACHE_PATH=FOLDER helps" in done.stderr
    assert not Path(done.stdout.split()[1]).exists()


@pytest.mark.parametrize("temporary", [True, False])
def test_a_full_disk_where_kernels_are_kept_is_passed_by_or_told(
    tmp_path: Path, child_environment: dict[str, str], temporary: bool
) -> None:
    """The compiler ended the process: "LLVM ERROR: IO failure on output stream"."""
    environment = child_environment | {"WARP_CACHE_PATH": str(tmp_path)}
    if not temporary:
        environment["TMPDIR"] = str(tmp_path)
    done = on_small_disk(tmp_path, "64k", '"$1" -c "$2"', environment, [sys.executable, RUN])
    if temporary:
        assert "compiled" in done.stdout and "No space left" in done.stderr
    else:
        assert "expected a folder with room for 4 MiB of compiled kernels" in done.stdout
        assert "WARP_CACHE_PATH=FOLDER" in done.stdout
