"""What a result was computed on: processor, memory and library versions. No host names, no paths."""

from __future__ import annotations

import contextlib
import importlib.metadata
import math
import os
import platform
import re
import resource
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

LIBRARIES = ("torch", "warp-lang", "numpy", "scipy", "scikit-image", "OpenEXR", "safetensors", "bpy", "hydra-core")


def machine() -> dict[str, str | int]:
    """Processor model, number of cores, memory [GiB], operating system and Python version."""
    pages, page = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return {
        "processor": _processor(),
        "cores": os.cpu_count() or 1,
        "memory_gib": round(pages * page / 2**30),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }


def available_memory_gib() -> float | None:
    """Memory that programs can have without swapping; None where the system does not tell."""
    file = Path("/proc/meminfo")
    found = re.search(r"^MemAvailable:\s*(\d+) kB", file.read_text(), re.MULTILINE) if file.is_file() else None
    return int(found[1]) / 2**20 if found else None


@cache
def library_versions() -> Mapping[str, str]:
    """Versions of the installed libraries that results depend on."""
    installed = {}
    for name in LIBRARIES:
        try:
            installed[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return installed


class PeakMemory:
    """Largest resident memory from now on, of this process or of a child.

    Where `reset_peak_memory` has no effect, earlier work counts too; where it is called meanwhile, only what follows.
    """

    def __init__(self) -> None:
        self._children = _largest_mib(resource.RUSAGE_CHILDREN)
        reset_peak_memory()

    def mib(self) -> int:
        """Of this process, or of a child that has ended since and was larger than any before."""
        own = peak_memory_now_mib()
        if math.isnan(own):
            own = _largest_mib(resource.RUSAGE_SELF)
        children = _largest_mib(resource.RUSAGE_CHILDREN)
        return round(max(own, children) if children > self._children else own)


def reset_peak_memory() -> None:
    """Let `peak_memory_now_mib` count from now on (Linux; elsewhere nothing happens)."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_memory_now_mib() -> float:
    """Largest resident memory of this process since `reset_peak_memory`; NaN where the system does not tell."""
    status = Path("/proc/self/status")
    found = re.search(r"^VmHWM:\s*(\d+) kB", status.read_text(), re.MULTILINE) if status.is_file() else None
    return int(found.group(1)) / 2**10 if found else math.nan


def _largest_mib(who: int) -> float:
    # Linux counts in KiB, macOS in bytes.
    return resource.getrusage(who).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        found = re.search(r"^model name\s*:\s*(.+)$", cpuinfo.read_text(errors="replace"), re.MULTILINE)
        if found:
            return found.group(1)
    return platform.processor() or platform.machine()
