"""Surfels on disk: a safetensors file, with how they compose (Coverage) in its note and gloss where there is any."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from torch import Tensor

from rgspipe.arguments import as_file, as_one_of
from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import is_number
from rgspipe.datasets.surfel_range import check_surfels
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.surfels import Coverage, Surfels, tensor_names

FORMAT = "rgspipe-surfels"
VERSION = 1

#: Before the names of the tensors of a scene's gloss; a diffuse scene has none.
GLOSS = "gloss."

#: Tensors that files of earlier versions lack.
OPTIONAL = {"guessed"}

#: What such a file is usually called.
SURFELS = "surfels.safetensors"

MAKE_AGAIN = "Remove it and run the stage that makes it again."


def save_surfels(path: str | Path, surfels: Surfels) -> None:
    """Write `surfels` with their coverage; the file appears under its name only when it is whole.

    Raises:
        InputError: no path of a file, or no surfels, or some with impossible numbers; see `Surfels.check`.
    """
    path = as_file(path, SURFELS)
    as_one_of(surfels, Surfels, "surfels", "Pass those of a scene: scene.surfels.").check()
    note = {"format": FORMAT, "version": VERSION, "coverage": asdict(surfels.coverage)}
    gloss = {} if surfels.gloss is None else {GLOSS + name: part for name, part in surfels.gloss.tensors().items()}
    save_tensors(path, surfels.tensors() | gloss, note)


def load_surfels(path: str | Path) -> Surfels:
    """The surfels in a file that `save_surfels` wrote, on the CPU.

    Raises:
        InputError: no such file, not safetensors, truncated, another version, or tensors that are missing,
            of a wrong shape or type, not finite, or gloss that makes energy.
    """
    path = input_file(path, "a file with surfels")
    tensors, note = load_tensors(path)
    coverage = _coverage(path, note)
    _check_tensors(path, tensors)
    own = {name: tensor for name, tensor in tensors.items() if not name.startswith(GLOSS)}
    try:
        surfels = Surfels(**own, coverage=coverage, gloss=_gloss(tensors))
        if surfels.gloss is not None:
            surfels.gloss.check(surfels.albedo)
    except ValueError as error:  # a wrong shape, or gloss out of range
        raise InputError(path, expected="surfels", found=str(error), remedy=MAKE_AGAIN) from error
    check_surfels(path, surfels, MAKE_AGAIN)
    return surfels


def _gloss(tensors: dict[str, Tensor]) -> Gloss | None:
    parts = {name.removeprefix(GLOSS): tensor for name, tensor in tensors.items() if name.startswith(GLOSS)}
    return Gloss(**parts) if parts else None


def _check_tensors(path: Path, tensors: dict[str, Tensor]) -> None:
    names = set(tensor_names())
    if any(name.startswith(GLOSS) for name in tensors):
        names |= {GLOSS + field.name for field in fields(Gloss)}
    if set(tensors) not in (names, names - OPTIONAL):
        listed = ", ".join(sorted(tensors)) or "none"
        raise InputError(path, expected=f"the tensors {', '.join(sorted(names))}", found=listed, remedy=MAKE_AGAIN)
    kinds = {tensor.dtype for tensor in tensors.values()}
    if len(kinds) > 1 or not next(iter(kinds)).is_floating_point:
        listed = ", ".join(sorted(str(kind) for kind in kinds))
        raise InputError(path, expected="floating-point tensors of one type", found=listed, remedy=MAKE_AGAIN)
    for name, tensor in tensors.items():
        if not tensor.isfinite().all():
            raise InputError(path, expected=f"finite {name}", found="NaN or infinity", remedy=MAKE_AGAIN)


def _coverage(path: Path, note: Any) -> Coverage:
    """The coverage in a file's note."""
    note = note if isinstance(note, dict) else {}
    kind = (note.get("format"), note.get("version"))
    if kind != (FORMAT, VERSION):
        wanted = f"format {FORMAT!r}, version {VERSION}"
        found = f"format {kind[0]!r}, version {kind[1]!r}"
        raise InputError(path, expected=wanted, found=found, remedy=MAKE_AGAIN)
    names = [field.name for field in fields(Coverage)]
    values = note.get("coverage")
    if not isinstance(values, dict) or set(values) != set(names) or not all(map(is_number, values.values())):
        wanted = f"coverage with the numbers {', '.join(names)}"
        raise InputError(path, expected=wanted, found=repr(values)[:120], remedy=MAKE_AGAIN)
    try:
        return Coverage(**values)
    except ValueError as error:
        raise InputError(path, expected="a coverage that can be", found=str(error), remedy=MAKE_AGAIN) from None
