"""Where a program computes: on the CPU, or on a CUDA GPU."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from rgspipe.errors import InputError

if TYPE_CHECKING:
    import torch

#: What may be asked for; "auto" is the GPU where there is one.
Wanted = Literal["auto", "cpu", "cuda"]
CHOICES: tuple[str, ...] = get_args(Wanted)


def chosen_device(wanted: Wanted) -> torch.device:
    """The device that is asked for.

    Raises:
        InputError: it is a GPU, and there is none that torch can use.
    """
    # Loaded here: what may be asked for is told without it.
    import torch

    there = torch.cuda.is_available()
    if wanted == "cuda" and not there:
        why = "torch is built without CUDA" if torch.version.cuda is None else "no GPU, or no driver for it"
        remedy = "device=auto takes what there is; rgspipe doctor says what that is."
        raise InputError("device", expected="a GPU that torch can use, for device=cuda", found=why, remedy=remedy)
    return torch.device("cuda" if there and wanted != "cpu" else "cpu")


def finish(device: torch.device) -> None:
    """Wait for what a device has been told to compute, which a GPU does while the program goes on."""
    import torch

    if device.type == "cuda":
        torch.cuda.synchronize(device)
