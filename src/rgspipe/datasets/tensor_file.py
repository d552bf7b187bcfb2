"""Tensors by name with a JSON note beside them, in safetensors, written whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch
import torch
from torch import Tensor

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import parse_json, shown
from rgspipe.datasets.limits import LARGEST
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.errors import InputError
from rgspipe.store.files import replacing

#: Types of the numbers of tensors.
DTYPES = (torch.float32, torch.float64, torch.int32, torch.int64, torch.uint8, torch.bool)

MAKE_AGAIN = "Remove it and run the stage that makes it again."


def save_tensors(path: Path, tensors: dict[str, Tensor], note: dict[str, Any] | None = None) -> None:
    """Write `tensors` and a JSON-able `note` to `path`; a reader never sees half a file."""
    whole = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    with replacing(path) as temporary:
        safetensors.torch.save_file(whole, temporary, metadata={"note": json.dumps(note or {}, sort_keys=True)})


@timed
def load_tensors(path: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """The tensors and the note of `save_tensors`.

    Raises:
        InputError: the file is missing or no safetensors file, or holds NaN, infinity or numbers beyond `LARGEST`.
    """
    input_file(path, "a safetensors file", most_bytes=reading_limits().bytes)
    tensors, note = _read(path)
    for name, tensor in tensors.items():
        if tensor.is_floating_point() and not bool((tensor.abs() <= LARGEST).all()):
            found = "values that are not finite" if not bool(tensor.isfinite().all()) else f"{_largest(tensor):g}"
            raise InputError(path, expected=f"finite {name} up to {LARGEST:g}", found=found, remedy=MAKE_AGAIN)
    return tensors, note


def _largest(tensor: Tensor) -> float:
    return float(tensor.double().abs().max())


def _read(path: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    try:
        with safetensors.safe_open(path, framework="pt") as file:
            note = (file.metadata() or {}).get("note", "{}")
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        note = parse_json(note)
        if not isinstance(note, dict):
            raise ValueError(f"a note that is no JSON object but {shown(note)}")
        if unusual := [f"{name} of {tensor.dtype}" for name, tensor in tensors.items() if tensor.dtype not in DTYPES]:
            raise ValueError(unusual[0])
        return tensors, note
    # The library lets errors of torch through.
    except (OSError, safetensors.SafetensorError, ValueError, TypeError, OverflowError, RuntimeError) as error:
        raise InputError(
            path,
            expected="a safetensors file",
            found=str(error).splitlines()[0] if str(error) else type(error).__name__,
            remedy=MAKE_AGAIN,
        ) from error
