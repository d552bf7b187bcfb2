"""How far rendered albedo is from the true one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rgspipe.evaluation.arrays import ArrayLike, to_array, to_mask

Images = Sequence[ArrayLike]


@dataclass(frozen=True)
class AlbedoErrors:
    """Errors over the counted pixels of several views; reflectance, so white is 1.

    Attributes:
        relative_l1: Σ|a − a*| / Σ a*, a fraction.
        psnr: 10·log₁₀(1 / mean squared error) [dB].
        scale: (3,) factors of red, green and blue that bring the rendered albedo closest to the true one, the same in
            all views: what a wrong brightness of all lights would do.
        relative_l1_scaled, psnr_scaled: the same errors after these factors.
        per_view: relative_l1 of each view; NaN where no pixel counts.
    """

    relative_l1: float
    psnr: float
    scale: tuple[float, float, float]
    relative_l1_scaled: float
    psnr_scaled: float
    per_view: tuple[float, ...]

    def summary(self) -> dict[str, Any]:
        """Everything but the views, as JSON values."""
        found = {name: value for name, value in asdict(self).items() if name != "per_view"}
        return found | {"scale": list(self.scale)}


def albedo_errors(rendered: Images, truth: Images, counted: Sequence[ArrayLike]) -> AlbedoErrors | None:
    """Compare albedo images, channel by channel.

    Args:
        rendered, truth: V images (H, W, 3).
        counted: V masks (H, W), True where a pixel counts: where there is surface.

    Returns:
        None if no pixel counts or the true albedo is black in all of them.

    Raises:
        ValueError: shapes or numbers of images differ, or a mask is not boolean.
    """
    if not len(rendered) == len(truth) == len(counted):
        raise ValueError(f"as many images as masks are needed, got {len(rendered)}, {len(truth)} and {len(counted)}")
    pairs = [_counted(*view) for view in zip(rendered, truth, counted, strict=True)]
    found, wanted = (np.concatenate(part) for part in zip(*pairs, strict=True)) if pairs else (np.empty((0, 3)),) * 2
    if not wanted.any():
        return None
    scale = _scale(found, wanted)
    return AlbedoErrors(
        relative_l1=_relative(found, wanted),
        psnr=_psnr(found, wanted),
        scale=tuple(scale.tolist()),
        relative_l1_scaled=_relative(found * scale, wanted),
        psnr_scaled=_psnr(found * scale, wanted),
        per_view=tuple(_relative(*pair) for pair in pairs),
    )


def _counted(found: ArrayLike, wanted: ArrayLike, mask: ArrayLike) -> tuple[npt.NDArray, npt.NDArray]:
    found, wanted, mask = to_array(found), to_array(wanted), to_mask(mask)
    if found.shape != wanted.shape or found.shape != (*mask.shape, 3):
        raise ValueError(f"albedo images (H, W, 3) and a mask (H, W) are needed, got {found.shape}, {wanted.shape}")
    return found[mask], wanted[mask]


def _scale(found: npt.NDArray, wanted: npt.NDArray) -> npt.NDArray[np.float64]:
    """Least-squares factors (3,); 1 for a channel in which the rendered albedo is black."""
    square = (found * found).sum(axis=0)
    return np.divide((found * wanted).sum(axis=0), square, out=np.ones(3), where=square > 0.0)


def _relative(found: npt.NDArray, wanted: npt.NDArray) -> float:
    total = float(wanted.sum())
    return float(np.abs(found - wanted).sum()) / total if total > 0.0 else math.nan


def _psnr(found: npt.NDArray, wanted: npt.NDArray) -> float:
    error = float(np.square(found - wanted).mean())
    return math.inf if error == 0.0 else -10.0 * math.log10(error)
