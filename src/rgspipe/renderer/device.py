"""The device that is asked for, where torch and Warp can both use it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rgspipe.errors import InputError

if TYPE_CHECKING:
    import torch

    from rgspipe.machine.device import Wanted

#: Warp's packages on PyPI are built with CUDA 13, which older drivers of NVIDIA's do not run.
OLD_DRIVER = "torch finds one and Warp does not: from PyPI it needs NVIDIA's driver 580 or later"


def chosen_device(wanted: Wanted) -> torch.device:
    """The device that is asked for.

    Raises:
        InputError: it is a GPU, and there is none.
    """
    # Loaded here: what may be asked for is told without it.
    import torch

    missing = None if wanted == "cpu" else missing_gpu()
    if wanted == "cuda" and missing is not None:
        remedy = "device=auto takes what there is; docs/guides/gpu.md says what a GPU needs."
        raise InputError("device", expected="a GPU, for device=cuda", found=missing, remedy=remedy)
    return torch.device("cpu" if wanted == "cpu" or missing is not None else "cuda")


def missing_gpu() -> str | None:
    """Why there is no GPU to compute on; None where there is one."""
    import torch

    if not torch.cuda.is_available():
        return "torch is built without CUDA" if torch.version.cuda is None else "no GPU, or no driver for it"
    # Starts Warp.
    from rgspipe.renderer.kernels.launch import warp_finds_gpu

    return None if warp_finds_gpu() else OLD_DRIVER
