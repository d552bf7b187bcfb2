"""Which Blender renders: its module in this interpreter or another one, or an installed program."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rgspipe
from rgspipe.blender.options import BlenderOptions
from rgspipe.errors import InputError

#: What renders outside Blender's own modules; see `blender.child`.
PACKAGES = ("torch", "numpy", "scipy", "OpenEXR")

#: The oldest Blender that was tried: its images are those of Blender 5 but for noise.
OLDEST = (3, 4)

#: Seconds in which an interpreter or Blender must have said what it is.
PATIENCE = 120.0

#: Prefix of the line on which it says so.
ANSWER = "@rgspipe is "

PROBE = f"""
import importlib.util, json, sys
bpy = sys.modules.get("bpy")
def denoises():
    try:
        bpy.context.scene.cycles.denoiser = "OPENIMAGEDENOISE"
    except TypeError:  # its enumeration has no such value
        return False
    return True
print({ANSWER!r} + json.dumps({{
    "python": list(sys.version_info[:2]), "path": [part for part in sys.path if part],
    "missing": [name for name in {("bpy", *PACKAGES)!r} if importlib.util.find_spec(name) is None],
    "blender": list(bpy.app.version) if bpy else None, "denoises": denoises() if bpy else None}}))
"""

#: Run by an installed Blender: our modules first, the packages of another interpreter after Blender's own.
BOOT = Path(__file__).with_name("boot.py")


@dataclass(frozen=True)
class Blender:
    """A Blender that is there.

    Attributes:
        start: the command, to which a module's name and arguments are added.
        words: what it is, for people.
        denoises: whether it was built with a denoiser, as Blender's modules are.
    """

    start: tuple[str, ...]
    words: str
    denoises: bool = True

    def command(self, module: str, *arguments: str) -> list[str]:
        """What runs `module` as a program."""
        return [*self.start, module, *arguments]


def find_blender(options: BlenderOptions, where: str, otherwise: str = "", denoise: bool = False) -> Blender:
    """The Blender that renders.

    Args:
        options: which it is.
        where: what is to be rendered, for errors.
        otherwise: how to do without Blender, a sentence.
        denoise: whether images are to be denoised.

    Raises:
        InputError: there is none, it is not what `options` say, or it cannot denoise.
    """
    if options.executable is not None:
        blender = _program(options.executable, options.python)
        if denoise and not blender.denoises:
            raise no_denoiser()
        return blender
    if options.python is not None:
        return _interpreter(options.python)
    if importlib.util.find_spec("bpy") is None:
        raise InputError(
            where,
            expected="Blender, which renders the images",
            found=f"none in this Python {sys.version_info[0]}.{sys.version_info[1]}",
            remedy=" ".join(filter(None, [HAVE_BLENDER, otherwise])),
        )
    return Blender((sys.executable, "-u", "-m"), "bpy")


#: What to do where there is no Blender.
HAVE_BLENDER = (
    "With Python 3.11, install its module: pip install 'rgspipe[blender]'. Else name another Python that has it "
    "(BlenderOptions(python=PATH)), or an installed Blender (BlenderOptions(executable=PATH))."
)


def no_denoiser() -> InputError:
    """What is wrong where images are to be denoised by a Blender that cannot."""
    return InputError(
        "DatasetOptions.denoise",
        expected="false with this Blender, which was built without Open Image Denoise",
        found="true",
        remedy="Set it, with four times as many DatasetOptions.samples; or take a Blender from blender.org.",
    )


def _interpreter(python: str) -> Blender:
    facts = _asked_python(python)
    if facts["missing"]:
        raise InputError(
            "BlenderOptions.python",
            expected=f"a Python with bpy, {', '.join(PACKAGES)}",
            found=f"{python} without {', '.join(facts['missing'])}",
            remedy=f"Have Python 3.11 there and install rgspipe in it: {python} -m pip install 'rgspipe[blender]'.",
        )
    return Blender((python, "-u", "-m"), f"bpy of {python}")


def _program(executable: str, python: str | None) -> Blender:
    facts = _asked(
        "BlenderOptions.executable",
        [executable, "--background", "--factory-startup", "--python-exit-code", "1", "--python-expr", PROBE],
        "an installed Blender",
    )
    version = ".".join(map(str, facts["blender"]))
    if tuple(facts["blender"]) < OLDEST:
        raise InputError(
            "BlenderOptions.executable",
            expected=f"Blender {'.'.join(map(str, OLDEST))} or later",
            found=version,
            remedy="Install a later one, or Blender's module: pip install 'rgspipe[blender]' with Python 3.11.",
        )
    lender = {"python": list(sys.version_info[:2]), "path": sys.path} if python is None else _asked_python(python)
    if lender["python"] != facts["python"]:
        own, wanted = (".".join(map(str, one["python"])) for one in (lender, facts))
        raise InputError(
            "BlenderOptions.executable",
            expected=f"a Blender that runs the Python that lends it rgspipe's packages, {own}",
            found=f"Blender {version}, which runs Python {wanted}",
            remedy=f"Install rgspipe with Python {wanted}, and name that: BlenderOptions(python=PATH).",
        )
    packages = os.pathsep.join(part for part in lender["path"] if "site-packages" in part or "dist-packages" in part)
    source = str(Path(rgspipe.__file__).resolve().parents[1])
    options = ("--background", "--factory-startup", "--python-exit-code", "1", "--python", str(BOOT), "--")
    return Blender((executable, *options, source, packages), f"Blender {version}", facts["denoises"])


def _asked_python(python: str) -> dict[str, Any]:
    return _asked("BlenderOptions.python", [python, "-c", PROBE], "a Python interpreter")


def _asked(key: str, command: Sequence[str], expected: str) -> dict[str, Any]:
    """What a program says it is.

    Raises:
        InputError: it cannot be started, or is something else.
    """
    remedy = f"Correct {key}, a path or the name of a command."
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=PATIENCE)
    except OSError as error:
        found = f"{command[0]}: {error.strerror}"
        raise InputError(key, expected=expected, found=found, remedy=remedy) from None
    except subprocess.TimeoutExpired:
        found = f"{command[0]}, which said nothing for {PATIENCE:.0f} s"
        raise InputError(key, expected=expected, found=found, remedy=remedy) from None
    for line in done.stdout.splitlines():
        if line.startswith(ANSWER):
            return json.loads(line[len(ANSWER) :])
    last = (done.stderr.strip() or done.stdout.strip() or "nothing").splitlines()[-1]
    found = f"{command[0]}, which ended with status {done.returncode} and said: {last}"
    raise InputError(key, expected=expected, found=found, remedy=remedy)
