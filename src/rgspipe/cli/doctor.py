"""`python -m rgspipe doctor`: whether what is needed works, what more there could be, how fast it is."""

from __future__ import annotations

import math
import os
import shutil
import textwrap
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rgspipe import __version__
from rgspipe.blender.interpreter import find_blender
from rgspipe.blender.options import OWN_BLENDER, BlenderOptions
from rgspipe.cli.arguments import refused
from rgspipe.cli.installation import EXTRAS, Distribution, needed_parts, optional_parts, slurm
from rgspipe.cli.messages import EXIT_FAILED, line_width
from rgspipe.config.spoken import as_keys
from rgspipe.datasets.input_file import folder_to_be
from rgspipe.errors import InputError
from rgspipe.machine.description import available_memory_gib, machine
from rgspipe.program import typed

if TYPE_CHECKING:
    from rgspipe.evaluation.self_check import Figure

#: Columns of what is printed.
WIDTH = 100

#: So many times the documented seconds are told as slow.
SLOW = 3.0


def doctor(arguments: Sequence[str]) -> int:
    """Print what is installed, what the machine has, and how accurate and fast it is; the exit status.

    Args:
        arguments: outputs=DIR; check=false leaves the measurements out; blender.* as for stages.

    Returns:
        1 if anything that is needed is broken.

    Raises:
        InputError: an argument cannot be used.
    """
    outputs, checked, blender = _parsed(arguments)
    folder_to_be(outputs, "the folder of results")
    host = machine()
    print(f"rgspipe {__version__}, Python {host['python']}, {host['system']}")
    ills, refused = _installed(), _blender(blender)
    if not ills:
        _print_machine()
    ills += _disk(outputs)
    if checked and not ills:
        ills += _measured()
    ills += refused
    if not ills:
        print(f"Everything that is needed works.\nNext, to see it find a lamp: {typed('demo')}")
        return 0
    print("\n".join(["To do:", *(_wrapped(ill, "  - ") for ill in ills)]))
    return EXIT_FAILED


def _parsed(arguments: Sequence[str]) -> tuple[Path, bool, BlenderOptions]:
    outputs, checked, blender = Path("outputs"), True, BlenderOptions()
    for text in arguments:
        key, _, value = text.partition("=")
        if key == "outputs" and value:
            outputs = Path(value)
        elif key == "check" and value in ("true", "false"):
            checked = value == "true"
        elif key in ("blender.python", "blender.executable") and value:
            blender = replace(blender, **{key.removeprefix("blender."): value})
        else:
            expected = "outputs=DIR, check=false, blender.python=PATH or blender.executable=PATH"
            raise refused(text, expected, "doctor")
    return outputs, checked, blender


def _installed() -> list[str]:
    """Print what is there and what is not; what has to be done about it."""
    parts, more = needed_parts(), optional_parts()
    if not parts:
        print("rgspipe runs from a folder and is not installed: what it needs is not known. In a checkout: make setup.")
    else:
        print(_wrapped(_listed([part for part in parts if part.works]), "Needed: "))
    print("Beyond what is needed:")
    for extra, gives in EXTRAS.items():
        for line in _extra([part for part in more if part.extra == extra], gives):
            print(line)
    found = "found" if slurm() else "not found"
    print(_wrapped(f"{found}: launcher=slurm sends the jobs of a sweep to a cluster", "  Slurm "))
    return [_ill(part) for part in parts if not part.works]


def _blender(options: BlenderOptions) -> list[str]:
    """Print which Blender renders, where one is named; what has to be done about it."""
    if options == OWN_BLENDER:
        return []
    try:
        found = find_blender(options, "blender")
    except InputError as error:
        return [as_keys(str(error))]
    print(_wrapped(f"{found.words} renders{'' if found.denoises else '; no denoiser: dataset.denoise=false'}", "  "))
    return []


def _listed(parts: Sequence[Distribution]) -> str:
    """Names and versions, which stay on one line each."""
    return ", ".join(f"{part.name}\N{NO-BREAK SPACE}{part.version}" for part in parts) or "none"


def _ill(part: Distribution) -> str:
    state = f"{part.name} {part.version} {part.fault}" if part.version else f"{part.name} is not installed"
    return f"{state}. Install it (in a checkout, make setup does): {part.remedy}"


def _extra(parts: Sequence[Distribution], gives: str) -> list[str]:
    """Lines on an extra: what it brings, whether that is there, and how to have it."""
    there = [part for part in parts if part.works]
    lines = [_wrapped(f"{_listed(there)}: {gives}", "  ")] if there else []
    if missing := [part for part in parts if part.version is None]:
        names, what = ", ".join(part.name for part in missing), "" if there else f": {gives}"
        are, them = ("is", "it") if len(missing) == 1 else ("are", "them")
        lines.append(_wrapped(f"{names} {are} missing{what}. To have {them}: {as_keys(missing[0].remedy)}", "  "))
    for part in parts:
        if part.fault:
            lines.append(
                _wrapped(f"{part.name} {part.version} {part.fault}. Without it there is none of: {gives}", "  ")
            )
    return lines


def _print_machine() -> None:
    # Loaded here: help need not wait for it, and it may be what is missing.
    import torch

    from rgspipe.renderer.device import missing_gpu

    host, cores = machine(), len(os.sched_getaffinity(0))
    threads = torch.get_num_threads()
    free = available_memory_gib()
    room = f"{host['memory_gib']} GiB of memory" + ("" if free is None else f", {free:.0f} free")
    print(f"Machine: {host['processor']}, {_counted(cores, 'core')}, {_counted(threads, 'thread')}, {room}")
    if threads < cores:
        print(_wrapped(f"{threads} of {cores} cores work: unset OMP_NUM_THREADS to have them all.", "  "))
    missing = missing_gpu()
    if missing is None:
        print(_wrapped(f"{torch.cuda.get_device_name()}; stages use it unless device=cpu says otherwise.", "CUDA: "))
    else:
        print(_wrapped(f"none ({missing}). Nothing needs it; it makes trainings and fits faster.", "CUDA: "))


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


def _disk(outputs: Path) -> list[str]:
    """Print what the results take and what room there is; what has to be done about it."""
    place = next(folder for folder in (outputs, *outputs.absolute().parents) if folder.is_dir())
    free = shutil.disk_usage(place).free / 1e9
    if not outputs.is_dir():
        print(f"Disk: {free:.1f} GB free; no results yet in {outputs}")
    else:
        print(_wrapped(f"{free:.1f} GB free; {_results(outputs)}", "Disk: "))
    if os.access(place, os.W_OK | os.X_OK):
        return []
    return [f"{place} cannot be written to. Give commands a folder of yours: outputs=FOLDER."]


def _results(outputs: Path) -> str:
    from rgspipe.store.retention import Choice, removable, stored

    try:
        everything = stored(outputs)
    except InputError as error:
        return f"{error} See {typed('verify')}."
    spare = sum(one.bytes for one in removable(everything, Choice())) / 1e6
    size = sum(one.bytes for one in everything) / 1e6
    words = f"{len(everything)} results in {outputs} take {size:.1f} MB"
    return f"{words}, of which nothing needs {spare:.1f} (outputs prune)" if spare >= 0.1 else words


def _measured() -> list[str]:
    """Print figures of accuracy and speed beside those of the docs; what has to be done about them."""
    from rgspipe.evaluation.self_check import self_check
    from rgspipe.renderer.device import chosen_device

    print("Check (half a minute at most; first use compiles kernels):", flush=True)
    ills, begin, slow = [], time.perf_counter(), False
    try:
        for figure in self_check(chosen_device("auto")):
            unit = f" {figure.unit}" if figure.unit else ""
            words = f"{figure.value:.2g}{unit} (docs: {figure.documented:.2g}{_verdict(figure)})"
            print(_wrapped(f"{figure.name}: {words}", "  "), flush=True)
            slow |= figure.unit == "s" and figure.value > SLOW * figure.documented
            if not figure.is_right:
                ills.append(f"{figure.name}: {figure.value:.2g}{unit} instead of {figure.documented:.2g}. {_ADVICE}")
    except Exception as error:  # whatever a broken library raises
        first = (str(error).splitlines() or [""])[0]
        ills.append(f"The check ended with {type(error).__name__}: {first}. {_ADVICE}")
    print(f"  {time.perf_counter() - begin:.0f} s in all")
    if slow:
        print(_wrapped("Slower than the laboratory: are other programs busy, or few threads allowed?", "  "))
    return ills


def _verdict(figure: Figure) -> str:
    """Whether a figure is as it should be; nothing of times, of which none is wrong."""
    if math.isinf(figure.limit):
        return ""
    return f"; {'right up to' if figure.is_right else 'wrong above'} {figure.limit:.2g}"


#: What to do where the library computes what it should not.
_ADVICE = (
    "Install the versions that are tested (make setup, or requirements.txt), remove Warp's compiled kernels "
    "(~/.cache/warp), and if that does not help, report it with all of the above."
)


def _wrapped(text: str, first: str) -> str:
    """Lines that fit a screen, those after the first set in."""
    after = "  " + " " * (len(first) - len(first.lstrip()))
    lines = textwrap.wrap(
        text,
        line_width(WIDTH),
        initial_indent=first,
        subsequent_indent=after,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines).replace("\N{NO-BREAK SPACE}", " ")
