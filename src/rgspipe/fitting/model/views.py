"""The views of a fit, made ready once and shared by all targets that the same cameras see."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.fitting.model.pixel_highlights import PixelHighlights
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.pixel_direct import PixelDirect
from rgspipe.renderer.sparse import SparseOperator, stack
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.arrays import ArrayLike, as_tensor

#: Pixels that surfels cover less than this show something the scene does not have.
LEAST_COVERAGE = 0.9

#: Pixels with a mask below this are not the scene's.
LEAST_MASK = 0.9

#: A mask may exceed 1 by this: rounding.
MASK_ROUNDING = 1e-3

#: A light has six unknowns, and each pixel tells three numbers; fewer pixels than this tell nothing reliable.
LEAST_PIXELS = 8


@dataclass(frozen=True)
class PreparedViews:
    """One or several views, stacked.

    Attributes:
        frozen: the scene that they show.
        views: their weights, V of them.
        masks: (H, W) in [0, 1] per view, the scene's share of each pixel.
        pixels: (P,) int64 pixels that a fit trusts, in the order of all views' pixels stacked.
        operator: (P, N) weights of those pixels.
        pixel_direct: per view its direct light where pixels look; empty where surfels' centres stand for them.
    """

    frozen: FrozenScene
    views: tuple[ViewWeights, ...]
    masks: tuple[Tensor, ...]
    pixels: Tensor
    operator: SparseOperator
    pixel_direct: tuple[PixelDirect, ...] = ()

    @cached_property
    def all_pixels(self) -> SparseOperator:
        """(all pixels of all views, N) weights, edges included."""
        return stack([view.operator for view in self.views])

    @cached_property
    def bounds(self) -> list[int]:
        """V + 1 places: view v has the trusted pixels from bounds[v] to bounds[v + 1]."""
        ends = np.cumsum([0, *(view.camera.pixel_count for view in self.views)])
        return np.searchsorted(self.pixels.cpu().numpy(), ends).tolist()

    @cached_property
    def view_of(self) -> Tensor:
        """(P,) int64 view of each trusted pixel."""
        counts = torch.tensor(self.bounds).diff()
        return torch.repeat_interleave(torch.arange(len(counts)), counts).to(self.pixels.device)

    @cached_property
    def rows(self) -> tuple[SparseOperator, ...]:
        """Per view the rows of `operator` that are its own."""
        matrix, device = self.operator.to_scipy(), self.operator.matrix.device
        pairs = itertools.pairwise(self.bounds)
        return tuple(SparseOperator.from_scipy(matrix[first:last], device) for first, last in pairs)

    @cached_property
    def highlights(self) -> tuple[PixelHighlights, ...]:
        """Of a scene with gloss, per view its highlights where pixels look; empty where `pixel_direct` is."""
        pairs = zip(self.views, self.pixel_direct, strict=True) if self.pixel_direct else ()
        gloss = self.frozen.gloss
        return () if gloss is None else tuple(PixelHighlights(gloss, view, direct) for view, direct in pairs)

    @cached_property
    def all_points(self) -> Tensor:
        """(all pixels of all views, 3) float64 place that each pixel looks at; for views with `pixel_direct`."""
        return torch.cat([direct.points for direct in self.pixel_direct])

    @cached_property
    def points(self) -> Tensor:
        """(P, 3) float64 place that each trusted pixel looks at; for views with `pixel_direct`."""
        return self.all_points[self.pixels]

    def stack_images(self, images: Sequence[ArrayLike]) -> Tensor:
        """(all pixels, 3) float32 of one image (H, W, 3) per view.

        Raises:
            InputError: a wrong number of images, a wrong size, display values, or pixels that are not finite.
        """
        checked = _one_each("images", images, self.views, (3,))
        for index, image in enumerate(checked):
            if float(image.double().sum()) < 0.0:
                found = f"pixels down to {float(image.min()):g}, which outweigh the positive ones"
                raise InputError(f"images[{index}]", expected="radiance ≥ 0", found=found, remedy="Make it again.")
        return torch.cat([image.reshape(-1, 3).float() for image in checked]).to(self.operator.matrix.device)

    def split_images(self, stacked: Tensor) -> list[Tensor]:
        """(H, W, 3) per view of stacked pixels (all pixels, 3)."""
        cameras = [view.camera for view in self.views]
        parts = stacked.split([camera.pixel_count for camera in cameras])
        return [part.reshape(camera.height, camera.width, 3) for part, camera in zip(parts, cameras, strict=True)]


def prepare_views(
    frozen: FrozenScene,
    views: Sequence[ViewWeights],
    *,
    masks: Sequence[ArrayLike] | None = None,
    mask_edges: bool = True,
    at_pixels: bool = False,
) -> PreparedViews:
    """Choose the pixels that a fit trusts and stack their weights.

    Surfels overhang silhouettes a little, and those pixels hold most of the squared error of a trained
    scene, so they are left out.

    Args:
        masks: (H, W) per view, the scene's share of each pixel (the images' alpha); 1 if None.
        mask_edges: whether pixels on silhouettes, creases and depth jumps are left out.
        at_pixels: whether the last steps of a fit take direct light where pixels look.

    Raises:
        InputError: a mask of the wrong size or with values outside of [0, 1], or too few pixels left.
    """
    if not views:
        raise InputError("views", expected="at least one", found="none", remedy="Choose views of the target.")
    masks = [torch.ones(v.camera.height, v.camera.width) for v in views] if masks is None else masks
    masks = _one_each("masks", masks, views, ())
    for index, mask in enumerate(masks):
        if not (float(mask.min()) >= 0.0 and float(mask.max()) <= 1.0 + MASK_ROUNDING):
            found = f"{float(mask.min()):g} to {float(mask.max()):g}"
            remedy = "Divide levels by the largest one."
            raise InputError(f"masks[{index}]", expected="values from 0 to 1", found=found, remedy=remedy)
    trusted = [_trusted(view, mask, mask_edges) for view, mask in zip(views, masks, strict=True)]
    pixels = torch.cat(trusted).nonzero()[:, 0]
    if len(pixels) < LEAST_PIXELS:
        raise InputError(
            "target",
            expected=f"at least {LEAST_PIXELS} pixels that show the scene away from edges",
            found=f"{len(pixels)} of {sum(v.camera.pixel_count for v in views)}",
            remedy="Check the masks and cameras; keep edge pixels with fit.search.mask_edges=false.",
        )
    rows = [
        view.operator.to_scipy()[chosen.cpu().numpy().nonzero()[0]] for view, chosen in zip(views, trusted, strict=True)
    ]
    operator = SparseOperator.from_scipy(scipy.sparse.vstack(rows, format="csr"), frozen.surfels.centers.device)
    direct = tuple(PixelDirect(frozen.bvh, view) for view in views) if at_pixels else ()
    return PreparedViews(frozen, tuple(views), tuple(masks), pixels, operator, direct)


def _trusted(view: ViewWeights, mask: Tensor, mask_edges: bool) -> Tensor:
    chosen = (view.coverage.cpu() > LEAST_COVERAGE) & (mask.reshape(-1).cpu() >= LEAST_MASK)
    return chosen & ~view.edges.cpu() if mask_edges else chosen


def _one_each(
    name: str, values: Sequence[ArrayLike], views: Sequence[ViewWeights], channels: tuple[int, ...]
) -> list[Tensor]:
    """One tensor (H, W, …) a view, finite.

    Raises:
        InputError: they are fewer or more, of another size, or not finite; or they are images of display values.
    """
    if len(values) != len(views):
        expected = f"one for each of the {len(views)} views"
        raise InputError(name, expected=expected, found=str(len(values)), remedy=f"Pass as many {name} as cameras.")
    checked = []
    for index, (view, value) in enumerate(zip(views, values, strict=True)):
        where = f"{name}[{index}]"
        if channels and "uint8" in str(getattr(value, "dtype", "")):
            raise InputError(
                where,
                expected="linear radiance, as floats",
                found="levels from 0 to 255",
                remedy="rg.load_views reads files as radiance, and rgspipe.scene.srgb.decode makes it of levels / 255.",
            )
        tensor = as_tensor(value, where, (view.camera.height, view.camera.width, *channels))
        if not bool(torch.isfinite(tensor).all()):
            raise InputError(where, expected="finite values", found="NaN or infinity", remedy="Make it again.")
        checked.append(tensor)
    return checked
