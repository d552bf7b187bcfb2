"""Whether photographs bear out that they were exposed alike, by one white balance, and are no darker in their corners.

With all of it free the equations of `capture.exposures` have an answer in each channel. It counts where it is larger
than what it changes by as one part of the scene after the other is left out (the jackknife of Quenouille and Tukey):
gloss, poses and depth that are off speak of an exposure of their own in one part only, a camera in all of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rgspipe.capture.exposures import Means, mean_shown, radial
from rgspipe.capture.options import CaptureOptions
from rgspipe.capture.photographs import Numbers, TracedPhotograph
from rgspipe.capture.receivers import PARTS
from rgspipe.datasets.views import View
from rgspipe.names import Exposure
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels

#: Surfels that are asked, evenly spread.
ASKED = 8000

#: Differences of this many standard errors are there, from this root mean square of their logarithm on, and corners
#: that are darker by this logarithm. In rooms without any, what photographs share tells of 2.2 and 0.02 at most, of
#: 1.9 and 0.05 where surfaces are glossy, and of 1.6 and 0.04 where every image is two pixels off.
BAR, LEAST, LEAST_CORNER = 4.0, 0.02, 0.06


@dataclass(frozen=True)
class Said:
    """What photographs have each for themselves, or their lens, as it is said or found.

    Attributes:
        exposure: whether they were exposed alike.
        vignetting: whether corners may be darker.
    """

    exposure: Exposure
    vignetting: bool

    @classmethod
    def of(cls, options: CaptureOptions) -> Said:
        """As options have it."""
        return cls(options.exposure, options.vignetting)

    def borne_out(self, weights: Sequence[ViewWeights], views: Sequence[View], surfels: Surfels) -> Said:
        """What has to be free: what is said to be, and what the photographs contradict.

        Args:
            weights: of the views, on the surfels.
            views: under one light.
        """
        if len(views) < 2:
            return self
        gains, corner = _found([TracedPhotograph.of(*pair) for pair in zip(weights, views, strict=True)], surfels)
        grey = gains.mean_of_channels()
        exposure = self.exposure
        if exposure != "free_colour" and gains.less(grey).differ:
            exposure = "free_colour"
        elif exposure == "same" and grey.differ:
            exposure = "free"
        return Said(exposure, self.vignetting or corner.mean_of_channels().is_dark)


@dataclass(frozen=True, eq=False)
class _Told:
    """Logarithms that all surfels tell, and those that B parts fewer do.

    Attributes:
        values: (3, K) in each channel.
        without: (B, 3, K) without each part.
    """

    values: Numbers
    without: Numbers

    def mean_of_channels(self) -> _Told:
        """The same in all channels."""
        return _Told(self.values.mean(axis=0, keepdims=True), self.without.mean(axis=1, keepdims=True))

    def less(self, other: _Told) -> _Told:
        """What is beside others."""
        return _Told(self.values - other.values, self.without - other.without)

    @property
    def _errors(self) -> Numbers:
        """(3, K) by the jackknife."""
        parts = len(self.without)
        away = self.without - self.without.mean(axis=0)
        return np.maximum(np.sqrt((parts - 1) / parts * (away**2).sum(axis=0)), 1e-9)

    @property
    def differ(self) -> bool:
        """Whether they are not all 0."""
        large = math.sqrt(float(np.mean(self.values**2)))
        return large > LEAST and float(np.mean((self.values / self._errors) ** 2)) > BAR**2

    @property
    def is_dark(self) -> bool:
        """Whether they are below 0."""
        return bool((self.values < -np.maximum(LEAST_CORNER, BAR * self._errors)).all())


def _found(photographs: Sequence[TracedPhotograph], surfels: Surfels) -> tuple[_Told, _Told]:
    """Gains of mean 0 of the V photographs, and one logarithm of what their corners have."""
    weights = [photograph.plain(photograph.base) for photograph in photographs]
    asked = np.arange(0, len(surfels), math.ceil(len(surfels) / ASKED))
    parts = cluster_patches(surfels.centers[asked].double(), surfels.normals[asked], PARTS, seed=0)
    shown = []
    for photograph, weight in zip(photographs, weights, strict=True):
        mean, count = mean_shown(photograph, np.concatenate([photograph.image, radial(photograph)], axis=1), weight)
        shown.append((mean[asked], count[asked]))
    means, counts = (np.stack(part) for part in zip(*shown, strict=True))
    columns = list(np.moveaxis(means[:, :, 3:], 2, 0))
    channels = [_all_and_without(Means.counting(means[:, :, c], counts), columns, parts) for c in range(3)]
    solved = np.stack(channels, axis=1)
    gains, corner = solved[..., : len(photographs)], solved[..., len(photographs) :].sum(axis=2, keepdims=True)
    return _Told(gains[0], gains[1:]), _Told(corner[0], corner[1:])


def _all_and_without(means: Means, columns: Sequence[Numbers], parts: NDArray[np.integer]) -> Numbers:
    """(1 + B, V + 2) gains of mean 0 and coefficients of columns, of all surfels and without each part."""
    own = [
        means.part(parts == part).equations([column[:, parts == part] for column in columns])
        for part in np.unique(parts)
    ]
    every = sum(own[1:], own[0])
    return np.stack([np.concatenate(one.solved(free=True)) for one in (every, *(every - part for part in own))])
