"""Surfels on disk: a safetensors file, with how they compose (Coverage) in its note."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from torch import Tensor

from rgspipe.datasets.json_file import is_number
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.scene.surfels import Coverage, Surfels

FORMAT = "rgspipe-surfels"
VERSION = 1

MAKE_AGAIN = "Remove it and run the stage that makes it again."


def save_surfels(path: str | Path, surfels: Surfels) -> None:
    """Write `surfels` with their coverage; the file appears under its name only when it is whole."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    note = {"format": FORMAT, "version": VERSION, "coverage": asdict(surfels.coverage)}
    save_tensors(path, surfels.tensors(), note)


def load_surfels(path: str | Path) -> Surfels:
    """The surfels in a file that `save_surfels` wrote, on the CPU.

    Raises:
        InputError: no such file, not safetensors, truncated, another version, or tensors that are missing,
            of a wrong shape or type, or not finite.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, expected="a file with surfels", found="no such file", remedy="Check the path.")
    tensors, note = load_tensors(path)
    coverage = _coverage(path, note)
    _check_tensors(path, tensors)
    try:
        return Surfels(**tensors, coverage=coverage)
    except ValueError as error:  # a wrong shape
        raise InputError(path, expected="surfels", found=str(error), remedy=MAKE_AGAIN) from error


def _check_tensors(path: Path, tensors: dict[str, Tensor]) -> None:
    names = {field.name for field in fields(Surfels)} - {"coverage"}
    if set(tensors) != names:
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
    return Coverage(**values)
