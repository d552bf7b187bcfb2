"""Pixels of one or several views of a frozen scene, stacked: where image models look."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from rgspipe.renderer.sparse import SparseOperator, stack
from rgspipe.renderer.view_weights import ViewWeights

if TYPE_CHECKING:
    from rgspipe.renderer.frozen import FrozenScene


@dataclass(frozen=True)
class ViewedPixels:
    """P pixels of V views.

    Attributes:
        frozen: the scene that they show.
        views: their weights.
        pixels: (P,) int64 which of them, in the order of all views' pixels stacked.
        operator: (P, N) weights of those pixels.
    """

    frozen: FrozenScene
    views: tuple[ViewWeights, ...]
    pixels: Tensor
    operator: SparseOperator

    @classmethod
    def every(cls, frozen: FrozenScene, views: Sequence[ViewWeights]) -> ViewedPixels:
        """All pixels of some views."""
        operator = stack([view.operator for view in views])
        pixels = torch.arange(operator.shape[0], device=operator.matrix.device)
        return ViewedPixels(frozen, tuple(views), pixels, operator)

    @cached_property
    def bounds(self) -> list[int]:
        """V + 1 places: view v has the pixels from bounds[v] to bounds[v + 1]."""
        ends = np.cumsum([0, *(view.camera.pixel_count for view in self.views)])
        return np.searchsorted(self.pixels.cpu().numpy(), ends).tolist()

    @cached_property
    def view_of(self) -> Tensor:
        """(P,) int64 view of each pixel."""
        counts = torch.tensor(self.bounds).diff()
        return torch.repeat_interleave(torch.arange(len(counts)), counts).to(self.pixels.device)

    @cached_property
    def own(self) -> tuple[Tensor, ...]:
        """Per view (P_v,) int64 which of its pixels these are."""
        starts = itertools.accumulate((view.camera.pixel_count for view in self.views), initial=0)
        parts = itertools.pairwise(self.bounds)
        return tuple(self.pixels[first:last] - start for (first, last), start in zip(parts, starts, strict=False))

    @cached_property
    def rows(self) -> tuple[SparseOperator, ...]:
        """Per view the rows of `operator` that are its own."""
        if len(self.views) == 1:
            return (self.operator,)
        matrix, device = self.operator.to_scipy(), self.operator.matrix.device
        pairs = itertools.pairwise(self.bounds)
        return tuple(SparseOperator.from_scipy(matrix[first:last], device) for first, last in pairs)

    def seen(self, radiance: Tensor) -> Tensor:
        """(P, 3, K) images of surfels with outgoing radiance (N, 3, K), the same in all directions."""
        channels, lightings = radiance.shape[1:]
        return (self.operator @ radiance.flatten(1)).reshape(-1, channels, lightings)

    def split(self, stacked: Tensor) -> list[Tensor]:
        """(H, W, 3) per view of stacked pixels (all pixels, 3)."""
        cameras = [view.camera for view in self.views]
        parts = stacked.split([camera.pixel_count for camera in cameras])
        return [part.reshape(camera.height, camera.width, 3) for part, camera in zip(parts, cameras, strict=True)]
