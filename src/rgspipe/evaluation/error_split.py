"""Where in its images a rendered scene is wrong: at edges, on shadow edges, near the light, or elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import ndimage

from rgspipe.datasets.views import View
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.metrics import edge_mask, peak

#: The classes; a pixel belongs to the first that it fits.
KINDS = ("edges", "shadow_edges", "near_light", "rest")

#: A pixel lies on a shadow's edge where the light's transmittance there differs by more between it and a neighbour.
SHADOW_STEP = 0.1

#: Surface nearer to the light than this fraction of the scene's longest side is near it.
NEAR_LIGHT = 0.2


@dataclass(frozen=True)
class ErrorSplit:
    """The squared error of V views by class of pixel.

    Attributes:
        pixels: (4,) share of all pixels in each of `KINDS`.
        error: (4,) its part of the mean squared error, each view in units of its peak²; they sum up to the whole.
    """

    pixels: npt.NDArray[np.float64]
    error: npt.NDArray[np.float64]

    def table(self) -> pd.DataFrame:
        """One row a class: share of pixels, share of the squared error, and PSNR [dB] within the class."""
        with np.errstate(divide="ignore", invalid="ignore"):
            within = -10.0 * np.log10(self.error / self.pixels)
            share = self.error / self.error.sum()
        return pd.DataFrame({"kind": KINDS, "pixels": self.pixels, "error": share, "psnr": within})


def pixel_kinds(view: View, transmittance: ArrayLike, scene_size: float) -> npt.NDArray[np.int64]:
    """(H, W) index into `KINDS` of every pixel of a view with light, depth and normals.

    Edges are silhouettes and creases of the depth and normal passes and the pixels around them. A shadow's edge passes
    where the transmittance varies by more than `SHADOW_STEP` over the 3 × 3 pixels around. All three follow from the
    true scene alone, so renders of different models are split alike.

    Args:
        transmittance: (H, W) part of the light that reaches what each pixel sees, of the true scene; NaN where there
            is nothing.
        scene_size: longest side of the scene, scene units.

    Raises:
        ValueError: the view has no light, depth or normals.
    """
    if view.light is None or view.depth is None or view.normal is None:
        raise ValueError(f"splitting errors needs a light, depth and normals; {view.name} lacks one of them")
    reaching = to_array(transmittance)
    if reaching.shape != tuple(view.depth.shape):
        raise ValueError(f"the transmittance must have shape {tuple(view.depth.shape)}, got {reaching.shape}")
    shadow = _range_around(reaching) > SHADOW_STEP
    near = _light_distance(view) < NEAR_LIGHT * scene_size
    edges = edge_mask(view.depth, view.normal)
    rest = KINDS.index("rest")
    return np.select([edges, shadow, near], [KINDS.index(k) for k in ("edges", "shadow_edges", "near_light")], rest)


def split_error(
    images: Sequence[ArrayLike], targets: Sequence[ArrayLike], kinds: Sequence[npt.NDArray[np.int64]]
) -> ErrorSplit:
    """The squared error of `images` (V of (H, W, 3)) by class, every view with the same weight.

    Views whose target has no peak above zero (black) are left out, as they have no PSNR.
    """
    pixels, errors = [], []
    for image, target, kind in zip(images, targets, kinds, strict=True):
        white = peak(target)
        if white <= 0.0:
            continue
        squared = np.square((to_array(image) - to_array(target)) / white).mean(axis=-1)
        pixels.append(np.bincount(kind.ravel(), minlength=len(KINDS)) / kind.size)
        errors.append(np.bincount(kind.ravel(), squared.ravel(), minlength=len(KINDS)) / kind.size)
    if not pixels:
        raise ValueError("no view whose target is brighter than black")
    return ErrorSplit(np.mean(pixels, axis=0), np.mean(errors, axis=0))


def _range_around(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Largest minus smallest of the finite values in the 3 × 3 pixels around; −inf where there are none."""
    known = np.isfinite(values)
    high = ndimage.maximum_filter(np.where(known, values, -np.inf), 3)
    return high - ndimage.minimum_filter(np.where(known, values, np.inf), 3)


def _light_distance(view: View) -> npt.NDArray[np.float64]:
    """(H, W) distance from the light of the surface in each pixel; inf where there is none."""
    depth = to_array(view.depth)
    origins, directions, lengths = (to_array(part) for part in view.camera.rays())
    surface = np.isfinite(depth)
    along = np.where(surface, depth, 0.0) * lengths.reshape(depth.shape)
    points = origins.reshape(-1, 3)[0] + directions.reshape(*depth.shape, 3) * along[..., None]
    distance = np.linalg.norm(points - to_array(view.light.position), axis=-1)
    return np.where(surface, distance, np.inf)
