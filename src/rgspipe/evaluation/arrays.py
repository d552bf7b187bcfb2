"""Measures take numpy arrays and torch tensors alike; this is where they become one thing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from torch import Tensor

from rgspipe.scene.arrays import ArrayLike


def to_array(values: ArrayLike) -> npt.NDArray[np.float64]:
    """A float64 numpy array of `values`; tensors are detached and brought to the CPU."""
    if isinstance(values, Tensor):
        values = values.detach().cpu().numpy()
    return np.asarray(values, dtype=np.float64)


def to_mask(values: ArrayLike) -> npt.NDArray[np.bool_]:
    """A boolean numpy array of `values`; anything that is not boolean is refused."""
    if isinstance(values, Tensor):
        values = values.detach().cpu().numpy()
    mask = np.asarray(values)
    if mask.dtype != np.bool_:
        raise ValueError(f"a mask must be boolean, got {mask.dtype}")
    return mask
