"""Where a program computes: on the CPU, or on a CUDA GPU."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Literal, get_args

if TYPE_CHECKING:
    import torch

#: What may be asked for (`renderer.device`); "auto" is the GPU where there is one.
Wanted = Literal["auto", "cpu", "cuda"]
CHOICES: tuple[str, ...] = get_args(Wanted)


def gpu_in_use() -> str | None:
    """Name of the GPU that this process has computed on; None where it has not."""
    torch = sys.modules.get("torch")
    return torch.cuda.get_device_name() if torch is not None and torch.cuda.is_initialized() else None


def finish(device: torch.device) -> None:
    """Wait for what a device has been told to compute, which a GPU does while the program goes on."""
    import torch

    if device.type == "cuda":
        torch.cuda.synchronize(device)
