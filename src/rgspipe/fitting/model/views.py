"""The views of a fit, made ready once and shared by all targets that the same cameras see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.arrays import ArrayLike, as_list, as_tensor, check_finite, check_levels, check_radiance
from rgspipe.scene.camera import AXES
from rgspipe.scene.guesses import guessed_surfaces

#: Pixels of which less than this is the scene's, by what surfels cover or by their mask, show something else.
LEAST_SHARE = 0.9

#: So much a mask may be out of range: it may have been resampled.
ROUNDING = 1e-3

#: Side of the squares of pixels of which a fit looks at one on its way. With 2 the pixels of a point light's image take
#: about as long as its surfels' shadows, so that 3 would save little more.
THINNED = 2

#: A light has six unknowns, and each pixel tells three numbers; fewer pixels than this tell nothing reliable.
LEAST_PIXELS = 8

#: What to do about an image of another shape.
IMAGE_REMEDY = (
    "Pass RGB with the channels last, as high and as wide as its camera; image[..., :3] drops alpha, and rg.load_views "
    "reads files."
)


@dataclass(frozen=True)
class PreparedViews(ViewedPixels):
    """One or several views, and the pixels of them that a fit trusts.

    Attributes:
        masks: (H, W) in [0, 1] per view, the scene's share of each pixel.
    """

    masks: tuple[Tensor, ...]

    @cached_property
    def every_pixel(self) -> ViewedPixels:
        """All pixels of all views, edges included."""
        return ViewedPixels.every(self.frozen, self.views)

    @cached_property
    def guesses(self) -> Tensor:
        """(S, N) 1 where a surfel of the scene is of one of S surfaces that no camera saw."""
        return guessed_surfaces(self.frozen.surfels)

    def without(self, pixels: Sequence[ArrayLike]) -> PreparedViews:
        """The same views less `pixels` (H, W) bool, one mask a view.

        Raises:
            InputError: too few pixels are left.
        """
        out = [torch.from_numpy(np.asarray(mask, dtype=bool)) for mask in pixels]
        kept = (~torch.cat([mask.reshape(-1) for mask in out]).to(self.pixels.device)[self.pixels]).nonzero()[:, 0]
        if len(kept) < LEAST_PIXELS:
            expected, found = f"at least {LEAST_PIXELS} pixels that are no lamp's", f"{len(kept)} of {len(self.pixels)}"
            raise InputError("emitters", expected=expected, found=found, remedy="Mark only what is a lamp itself.")
        masks = tuple(torch.where(mask.to(own.device), 0.0, own) for own, mask in zip(self.masks, out, strict=True))
        return replace(self._of(kept), masks=masks)

    def _of(self, kept: Tensor) -> PreparedViews:
        """With the `kept` (K,) of the pixels alone."""
        return replace(self, pixels=self.pixels[kept], operator=self.operator.rows(kept))

    @cached_property
    def few_pixels(self) -> Tensor:
        """(K,) int64 which pixels a fit looks at on its way: one drawn from each square of THINNED by THINNED."""
        generator, chosen = torch.Generator().manual_seed(0), []
        for view in self.views:
            rows, columns = torch.arange(view.camera.height)[:, None], torch.arange(view.camera.width)
            squares = (len(rows) // THINNED + 1, len(columns) // THINNED + 1)
            drawn = torch.randint(THINNED**2, squares, generator=generator)[rows // THINNED, columns // THINNED]
            chosen.append((THINNED * (rows % THINNED) + columns % THINNED == drawn).reshape(-1))
        return torch.cat(chosen).to(self.pixels.device)[self.pixels].nonzero()[:, 0]

    @cached_property
    def thinned(self) -> PreparedViews:
        """The views with `few_pixels` alone."""
        return self._of(self.few_pixels)

    def emitter_masks(self, masks: Sequence[ArrayLike]) -> list[npt.NDArray[np.bool_]]:
        """(H, W) bool a view, of masks that are 1 where a lamp's own pixels are.

        Raises:
            InputError: a wrong number of them, a wrong size, or impossible values.
        """
        checked = _one_each("emitters", masks, self.views, ())
        _check_masks(checked, "emitters", "1 where a lamp is, 0 elsewhere")
        return [(mask >= 0.5).cpu().numpy() for mask in checked]

    def stack_images(self, images: Sequence[ArrayLike] | ArrayLike, name: str = "images") -> Tensor:
        """(all pixels, 3) float32 of one image (H, W, 3) per view, called `name` in errors.

        Raises:
            InputError: a wrong number of images, a wrong size, display values, or pixels that are not finite.
        """
        checked = _one_each(name, as_list(images, axes=3), self.views, (3,))
        for index, image in enumerate(checked):
            check_radiance(f"{name}[{index}]", float(image.detach().min()), float(image.detach().max()))
        return torch.cat([image.detach().reshape(-1, 3).float() for image in checked]).to(self.operator.matrix.device)


def prepare_views(
    frozen: FrozenScene,
    views: Sequence[ViewWeights],
    *,
    masks: Sequence[ArrayLike] | None = None,
    mask_edges: bool = True,
) -> PreparedViews:
    """Choose the pixels that a fit trusts and stack their weights.

    Surfels overhang silhouettes a little, and those pixels hold most of the squared error of a trained
    scene, so they are left out.

    Args:
        masks: (H, W) per view, the scene's share of each pixel (the images' alpha); 1 if None.
        mask_edges: whether pixels on silhouettes, creases and depth jumps are left out.

    Raises:
        InputError: a mask of the wrong size or with impossible values, or too few pixels left.
    """
    if not views:
        raise InputError("views", expected="at least one", found="none", remedy="Choose views of the target.")
    masks = [torch.ones(v.camera.height, v.camera.width) for v in views] if masks is None else masks
    masks = _one_each("masks", masks, views, ())
    _check_masks(masks)
    trusted = [_trusted(view, mask, mask_edges) for view, mask in zip(views, masks, strict=True)]
    pixels = torch.cat(trusted).nonzero()[:, 0]
    if len(pixels) < LEAST_PIXELS:
        raise InputError(
            "target",
            expected=f"at least {LEAST_PIXELS} pixels that show the scene away from edges",
            found=f"{len(pixels)} of {sum(v.camera.pixel_count for v in views)}",
            remedy=f"Check the masks, and that {AXES}. With mask_edges off, pixels on edges count, too.",
        )
    rows = [
        view.operator.to_scipy()[chosen.cpu().numpy().nonzero()[0]] for view, chosen in zip(views, trusted, strict=True)
    ]
    operator = SparseOperator.from_scipy(scipy.sparse.vstack(rows, format="csr"), frozen.device)
    return PreparedViews(frozen, tuple(views), pixels.to(frozen.device), operator, tuple(masks))


def _trusted(view: ViewWeights, mask: Tensor, mask_edges: bool) -> Tensor:
    chosen = (view.coverage.cpu() > LEAST_SHARE) & (mask.reshape(-1).cpu() >= LEAST_SHARE)
    return chosen & ~view.edges.cpu() if mask_edges else chosen


def _one_each(
    name: str, values: Sequence[ArrayLike], views: Sequence[ViewWeights], channels: tuple[int, ...]
) -> list[Tensor]:
    """One tensor (H, W, …) a view, finite.

    Raises:
        InputError: they are fewer or more, of another size, or not finite; or they are images of display values.
    """
    if len(values) != len(views):
        expected, found = f"as many as there are views ({len(views)})", f"{len(values)} of them"
        shape = f"(H, W{', 3' if channels else ''})"
        raise InputError(name, expected=expected, found=found, remedy=f"Pass as many {name} as cameras, each {shape}.")
    checked = []
    for index, (view, value) in enumerate(zip(views, values, strict=True)):
        where = f"{name}[{index}]"
        if channels:
            check_levels(where, value)
        size = (view.camera.height, view.camera.width, *channels)
        tensor = as_tensor(value, where, size, remedy=IMAGE_REMEDY if channels else "")
        # As fits take it: single precision holds less.
        check_finite(tensor.float(), where, "Make it again.")
        checked.append(tensor)
    return checked


def _check_masks(
    masks: Sequence[Tensor], name: str = "masks", expected: str = "the scene's share of each pixel, 0 to 1"
) -> None:
    """Refuse masks that are no shares of pixels, such as levels of 8 bits.

    Raises:
        InputError: a value is below 0 or above 1.
    """
    for index, mask in enumerate(masks):
        least, most = float(mask.min()), float(mask.max())
        if least < -ROUNDING or most > 1.0 + ROUNDING:
            raise InputError(
                f"{name}[{index}]",
                expected=expected,
                found=f"values from {least:.4g} to {most:.4g}",
                remedy="Divide levels of 8 bits by 255, and clamp what is left.",
            )
