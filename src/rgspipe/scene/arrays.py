"""Numbers, lists, numpy arrays and tensors as the tensors that the library works on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from rgspipe.errors import InputError

#: What is taken wherever a tensor is meant: numbers, lists of them, numpy arrays, tensors.
ArrayLike: TypeAlias = "Tensor | npt.ArrayLike"

#: Kinds of numpy's types that are numbers: booleans, integers, floats.
NUMBERS = "biuf"

#: What to pass where numbers are meant, if nothing more can be said.
REMEDY = "Pass a list, numpy array or tensor."

#: What to do with numbers of another shape, if nothing more can be said.
SHAPE_REMEDY = "Pass them in this shape."

#: Noise reaches about as far below zero as above it; what reaches so many times as far is a broken pixel.
NOISE = 2.0

#: Bits of a level, by what the types of stored images are called, in numpy, torch, and the protocol of arrays.
LEVELS = {"uint8": 8, "u1": 8, "uint16": 16, "u2": 16}

#: Kinds of devices that there are kernels for.
DEVICES = ("cpu", "cuda")

#: How many entries an axis has; a name for any number of them.
Axis = int | str


def as_tensor(
    value: ArrayLike, name: str, shape: Sequence[Axis], dtype: torch.dtype | None = None, remedy: str = ""
) -> Tensor:
    """`value` as a floating-point tensor of `shape`.

    A tensor of floats stays the one that it is, with its device and its gradients, unless `dtype` says otherwise;
    everything else becomes float64 on the CPU.

    Args:
        name: what errors call it.
        shape: entries along each axis, names where any number will do, such as ("H", "W", 3).
        remedy: what errors tell to do; to pass numbers, or to pass them in this shape, if empty.

    Raises:
        InputError: it holds no numbers, or has another shape.
    """
    tensor = value if isinstance(value, Tensor) else _from_numbers(value, name, shape, remedy or REMEDY)
    if tensor.is_complex() or tensor.layout != torch.strided or tensor.device.type not in DEVICES:
        _refuse(name, shape, f"a tensor of {tensor.dtype}, {tensor.layout}, on {tensor.device}", remedy or REMEDY)
    if not tensor.is_floating_point():
        tensor = tensor.double()
    if not _fits(tensor.shape, shape):
        _refuse(name, shape, f"shape {_written(tensor.shape)}", remedy or SHAPE_REMEDY)
    return tensor if dtype is None else tensor.to(dtype)


def as_list(value: Sequence[ArrayLike] | ArrayLike, axes: int) -> list[ArrayLike]:
    """Several arrays of `axes` axes each; one of them, also one with too few axes, stands for a list of it."""
    none = isinstance(value, list | tuple) and not value
    return [value] if _axes(value) <= axes and not none else list(value)


def as_device(device: torch.device | str) -> torch.device:
    """A device that this machine has.

    Raises:
        InputError: it has no such device, or there is none of this name.
    """
    try:
        made = torch.device(device)
        if made.type not in DEVICES:
            raise RuntimeError(f"{made.type} is not used")
        torch.empty(0, device=made)
    except (
        RuntimeError,
        AssertionError,
        TypeError,
    ) as error:  # no such name, no such part
        found, remedy = f"{device!r:.40} ({str(error).splitlines()[0]:.80})", "Pass cpu."
        raise InputError("device", expected="cpu, or cuda where there is a GPU", found=found, remedy=remedy) from None
    return made


def check_finite(tensor: Tensor, name: str, remedy: str) -> None:
    """Refuse NaN and infinity.

    Raises:
        InputError: there is some.
    """
    if not bool(torch.isfinite(tensor).all()):
        raise InputError(name, expected="finite numbers", found="NaN or infinity", remedy=remedy)


def _axes(value: object) -> int:
    """How many axes an array has, or lists of lists, by their first entries."""
    depth = 0
    while isinstance(value, list | tuple) and value:
        value, depth = value[0], depth + 1
    return depth + getattr(value, "ndim", 0)


def check_radiance(where: object, least: float, most: float) -> None:
    """Refuse an image whose lowest value is no noise: that is about as far above zero as below.

    Args:
        where: what is refused.
        least, most: its lowest and highest value.

    Raises:
        InputError: the lowest value is negative by more than NOISE times the highest.
    """
    if least < -NOISE * max(most, 0.0):
        found = f"values down to {least:g}, and none above {most:g}"
        raise InputError(where, expected="radiance, which is not negative", found=found, remedy="Export it again.")


def check_levels(where: object, image: object) -> None:
    """Refuse an image of 8 or 16 bits, an array, a tensor or one of PIL's, where radiance is meant.

    Raises:
        InputError: it is one.
    """
    stored = getattr(image, "dtype", None) or getattr(image, "__array_interface__", {}).get("typestr", "")
    bits = next((bits for name, bits in LEVELS.items() if name in str(stored)), 0)
    if bits:
        most = 2**bits - 1
        remedy = f"rg.load_views reads files as radiance, and rgspipe.scene.srgb.decode makes it of levels / {most}"
        remedy += ", which are radiance as they are if no curve was put on them." if bits > 8 else "."
        found = f"levels from 0 to {most}"
        raise InputError(where, expected="linear radiance, as floats", found=found, remedy=remedy)


def _from_numbers(value: object, name: str, shape: Sequence[Axis], remedy: str) -> Tensor:
    if isinstance(value, list | tuple) and any(isinstance(part, Tensor) for part in value):
        try:
            return torch.stack([torch.as_tensor(part).double() for part in value])
        except (RuntimeError, TypeError, ValueError):
            parts = [_written(part.shape) if isinstance(part, Tensor) else type(part).__name__ for part in value[:4]]
            _refuse(name, shape, f"a list of {', '.join(parts)}{', …' if len(value) > 4 else ''}", remedy)
    try:
        array = np.array(value)
    except ValueError:  # rows of different lengths
        array = np.array(None)
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        _refuse(name, shape, "a masked array, of which some are none", "Fill it, and say by masks what does not count.")
    if array.dtype.kind not in NUMBERS:
        _refuse(name, shape, f"{type(value).__name__} {value!r}"[:120], remedy)
    return torch.from_numpy(array.astype(np.float64))


def _fits(found: Sequence[int], wanted: Sequence[Axis]) -> bool:
    return len(found) == len(wanted) and all(isinstance(b, str) or a == b for a, b in zip(found, wanted, strict=True))


def _refuse(name: str, shape: Sequence[Axis], found: str, remedy: str) -> NoReturn:
    raise InputError(name, expected=f"numbers of shape {_written(shape)}", found=found, remedy=remedy)


def _written(shape: Sequence[Axis]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
