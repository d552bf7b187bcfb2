"""What rgspipe stands on: which of it is installed, whether it works, and what there would be with the rest."""

from __future__ import annotations

import contextlib
import importlib
import importlib.metadata
import importlib.util
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from rgspipe.blender.interpreter import HAVE_BLENDER

#: Modules of distributions that are called otherwise.
MODULES = {
    "flip-evaluator": "flip_evaluator",
    "hydra-core": "hydra",
    "hydra-joblib-launcher": "hydra_plugins.hydra_joblib_launcher",
    "openexr": "OpenEXR",
    "pyyaml": "yaml",
    "scikit-image": "skimage",
    "warp-lang": "warp",
}

#: What there is with the extras of the package.
EXTRAS = {
    "blender": "renders datasets, targets and truth; images of your own need none (scene=external, rgbd, mesh)",
    "raw": "photographs as a camera's sensor has them (RAW), in captures",
    "bench": "the path tracer that stage=benchmark compares with",
    "dev": "tests, the site of the docs and lint, which developers alone need",
}

#: Those that are tried in a process of their own, as they may take it down.
TRIED_APART = ("bpy",)

#: Seconds that such a process has.
PATIENCE = 120.0


@dataclass(frozen=True)
class Distribution:
    """A distribution that is installed, or could be.

    Attributes:
        name: as pip calls it.
        wanted: versions that will do, as pip writes them.
        version: what is installed; None if it is not.
        fault: why it cannot be used, in words; empty if it can.
        extra: of the package, that brings it; empty for what is always needed.
    """

    name: str
    wanted: str
    version: str | None
    fault: str = ""
    extra: str = ""

    @property
    def works(self) -> bool:
        """Whether it is installed, and nothing is wrong with it."""
        return self.version is not None and not self.fault

    @property
    def remedy(self) -> str:
        """The command that brings it, and all of its extra."""
        if self.name == "bpy":
            return HAVE_BLENDER
        what = f"rgspipe[{self.extra}]" if self.extra else f"{self.name}{self.wanted}"
        return f'{sys.executable} -m pip install "{what}"'


def needed_parts() -> list[Distribution]:
    """What every command may need, each tried; empty where the package itself was not installed."""
    return [_tried(name, wanted) for name, wanted, extra in _requirements() if not extra]


def optional_parts() -> list[Distribution]:
    """What the extras bring; of those for developers it is only seen whether they are there."""
    found = []
    for name, wanted, extra in _requirements():
        if not extra:
            continue
        version = _version(name)
        fault = _apart(name) if name in TRIED_APART and version is not None else ""
        found.append(Distribution(name, wanted, version, fault, extra))
    return found


def slurm() -> str | None:
    """Where the command is that sends jobs to a cluster; None without."""
    return shutil.which("sbatch")


def _requirements() -> Iterator[tuple[str, str, str]]:
    """Name, versions and extra of all that the installed package says it needs."""
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        for text in importlib.metadata.requires("rgspipe") or ():
            condition = re.search(r"""extra == ['"]([\w-]+)['"]""", text)
            named = re.match(r"([\w.-]+)(?:\[[^\]]*\])?\s*([^;]*)", text)
            assert named is not None
            yield named[1].lower(), named[2].strip(), condition[1] if condition else ""


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _tried(name: str, wanted: str) -> Distribution:
    version = _version(name)
    if version is None:
        return Distribution(name, wanted, None)
    try:
        importlib.import_module(MODULES.get(name, name.replace("-", "_")))
        fits = _fits(version, wanted)
    except Exception as error:  # whatever a broken library raises
        return Distribution(name, wanted, version, f"does not load: {_first_line(error)}")
    return Distribution(name, wanted, version, "" if fits else f"is not {wanted}")


def _fits(version: str, wanted: str) -> bool:
    # Loaded here: it may be what is missing, and that is to be told like all else.
    from packaging.specifiers import SpecifierSet

    return SpecifierSet(wanted).contains(version, prereleases=True)


def _apart(name: str) -> str:
    """Why a module does not load in a process of its own; empty if it does."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", f"import {name}"], capture_output=True, text=True, errors="replace", timeout=PATIENCE
        )
    except subprocess.TimeoutExpired:
        return f"does not load within {PATIENCE:.0f} s"
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines() or [f"its process ended with {done.returncode}"]
    return f"does not load: {lines[-1]}"


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
