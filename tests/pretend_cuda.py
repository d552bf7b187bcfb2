"""A CUDA device that is not there: tensors in ordinary memory that know where they would be.

Within `pretend_cuda()` the device "cuda" exists. Operations on tensors of two devices, and numpy arrays of tensors that
are not on the CPU, are refused as torch would refuse them; kernels run on the CPU. It shows that code runs where it is
told, on machines without a GPU; that kernels are right on one is for tests on one.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import torch
import warp as wp
from torch import Tensor
from torch.autograd.graph import _engine_run_backward as run_backward
from torch.overrides import TorchFunctionMode

CPU, CUDA = torch.device("cpu"), torch.device("cuda", 0)

#: Tensors may be indexed by tensors on the CPU, and copied from anywhere.
INDEXING, COPYING = ("__getitem__", "__setitem__"), ("copy_",)

#: Where the data itself leaves torch.
LEAVING = ("numpy", "__array__")


def where(tensor: Tensor) -> torch.device | None:
    """The device that a tensor would be on; None where that is not known, as of gradients."""
    return tensor.__dict__.get("pretended")


class _Mode(TorchFunctionMode):
    def __torch_function__(
        self, function: Callable, types: Any, args: tuple = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        kwargs, name = dict(kwargs or {}), _name(function)
        if name in ("get device", "get is_cuda"):
            device = where(args[0]) or CPU
            return device if name == "get device" else device == CUDA
        if name in ("to", "cpu", "cuda"):
            return _moved(name, args, kwargs)
        devices = {where(tensor) for tensor in _tensors((args, kwargs)) if tensor.dim() > 0} - {None}
        if name in LEAVING and where(args[0]) == CUDA:
            raise TypeError("can't convert a tensor on cuda to numpy")
        indexed = name in INDEXING and where(args[0]) == CUDA
        if len(devices) > 1 and not indexed and name not in COPYING:
            raise RuntimeError(f"{name} of tensors on cuda and on cpu")
        wanted = kwargs.pop("device", None)
        if wanted is not None and torch.device(wanted) == CPU:
            wanted = CPU
        elif wanted is not None:
            wanted = CUDA
            if kwargs.get("generator") is not None:
                raise RuntimeError("a generator of the CPU cannot draw on cuda")
        if name == "backward":
            # Functions of our own make tensors in it, which the mode sees where it is entered again; torch's own door
            # to it would then lead here.
            with self:
                roots = (args[0],), (torch.ones_like(args[0]),)
                return run_backward(*roots, False, False, (), allow_unreachable=True, accumulate_grad=True)
        result = function(*args, **kwargs)
        if wanted is None and (name in INDEXING or name in COPYING):
            wanted = where(args[0])
        return _marked(result, wanted or next(iter(devices), None) or _made_on(args, kwargs))


def _name(function: Callable) -> str:
    """Of a function or method; of the reader of an attribute "get" and the attribute."""
    name = getattr(function, "__name__", "")
    return f"get {function.__self__.__name__}" if name == "__get__" else name


def _made_on(args: tuple, kwargs: dict[str, Any]) -> torch.device | None:
    """The CPU for what is made of no tensor; not known for what is made of tensors that are not."""
    scalars = [where(tensor) for tensor in _tensors((args, kwargs))]
    return (CUDA if CUDA in scalars else CPU if CPU in scalars else None) if scalars else CPU


def _moved(name: str, args: tuple, kwargs: dict[str, Any]) -> Tensor:
    tensor, *rest = args
    given = [*rest, *kwargs.values()]
    targets = [where(x) or CPU for x in given if isinstance(x, Tensor)]
    targets += [torch.device(x) for x in given if isinstance(x, str | torch.device)]
    target = {"cpu": CPU, "cuda": CUDA}.get(name) or (targets[0] if targets else where(tensor))
    if name == "to":
        plain = [CPU if isinstance(x, str | torch.device) else x for x in rest]
        moved = tensor.to(*plain, **{key: x for key, x in kwargs.items() if key != "device"})
    else:
        moved = tensor
    if target is not None and moved is tensor and (where(tensor) or CPU).type != target.type:
        moved = tensor.clone() if tensor.layout == torch.strided else tensor.detach().clone()
    if moved is tensor and where(tensor) is not None:
        return tensor
    return _marked(moved, CUDA if target is not None and target.type == "cuda" else target)


def _tensors(value: Any) -> Iterator[Tensor]:
    if isinstance(value, Tensor):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _tensors(item)
    elif isinstance(value, dict):
        yield from _tensors(list(value.values()))


def _marked(result: Any, device: torch.device | None) -> Any:
    if isinstance(result, Iterator):
        result = iter([_marked(item, device) for item in result])
    for tensor in _tensors(result):
        if device is None:
            tensor.__dict__.pop("pretended", None)
        else:
            tensor.__dict__["pretended"] = device
    return result


@contextlib.contextmanager
def pretend_cuda() -> Iterator[None]:
    """Within it the device "cuda" exists, as far as this module pretends."""
    array, tensor, from_numpy = wp.from_torch, wp.to_torch, torch.from_numpy

    def as_warp(value: Tensor, *args: Any, **kwargs: Any) -> wp.array:
        with torch._C.DisableTorchFunction():
            made = array(value, *args, **kwargs)
        made.pretended = where(value)
        return made

    def as_torch(value: wp.array, *args: Any, **kwargs: Any) -> Tensor:
        return _marked(tensor(value, *args, **kwargs), getattr(value, "pretended", None))

    def run(kernel: wp.Kernel, dim: int, inputs: list[Any], device: Any) -> None:
        places = {getattr(value, "pretended", None) for value in inputs} - {None}
        if len(places) > 1:
            raise RuntimeError(f"{kernel.key} reads arrays on cuda and on cpu")
        return original(kernel, dim=dim, inputs=inputs, device="cpu")

    original = wp.launch
    with pytest.MonkeyPatch.context() as patch, _Mode():
        patch.setattr(torch, "from_numpy", lambda value: _marked(from_numpy(value), CPU))
        patch.setattr(torch.cuda, "is_available", lambda: True)
        patch.setattr(torch.cuda, "synchronize", lambda device=None: None)
        patch.setattr(wp, "is_cuda_available", lambda: True)
        patch.setattr(wp, "from_torch", as_warp)
        patch.setattr(wp, "to_torch", as_torch)
        patch.setattr(wp, "device_from_torch", lambda device: "cpu")
        patch.setattr(wp, "launch", run)
        patch.setattr(torch.cuda, "current_stream", lambda device: None)
        patch.setattr(wp, "stream_from_torch", lambda stream: None)
        patch.setattr(wp, "ScopedStream", lambda stream: contextlib.nullcontext())
        yield
