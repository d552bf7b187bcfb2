"""What cameras did to the light: exposures, white balance and vignetting, by what photographs share.

    I_p = g_vc exp(a r² + b r⁴) (W L)_pc

with one factor g a photograph v (and channel c, where white balance is free), and a, b of the lens that took all of
them; r is a pixel's distance from the principal point, 1 in the farthest corner. In the means l_vi of the logarithms
over the pixels of photograph v that show surfel i all of them are linear,

    l_vi = g_v + a r²_vi + b r⁴_vi + log L_i ,

and log L_i is eliminated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rgspipe.datasets.views import View

Numbers = NDArray[np.float64]
Exposure = Literal["same", "free", "free_colour"]

#: Powers of r² in the vignetting.
POWERS = (1, 2)


@dataclass(frozen=True, eq=False)
class Cameras:
    """Factors of V photographs with P pixels, and what of them is free.

    Attributes:
        of_view: (P,) photograph of each pixel.
        radius: (P,) r².
        exposure, vignetting: what is not known.
        gains: (V, 3) g, of mean logarithm 0 in each channel.
        falloff: (2,) a, b.
    """

    of_view: NDArray[np.intp]
    radius: Numbers
    exposure: Exposure
    vignetting: bool
    gains: Numbers
    falloff: Numbers

    @classmethod
    def of(cls, views: Sequence[View], exposure: Exposure, vignetting: bool) -> Cameras:
        """All alike, before anything is known."""
        of_view = np.repeat(np.arange(len(views)), [view.camera.pixel_count for view in views])
        radius = np.concatenate([_squared_radius(view) for view in views])
        return cls(of_view, radius, exposure, vignetting, np.ones((len(views), 3)), np.zeros(2))

    @cached_property
    def level(self) -> Numbers:
        """(P, 3) what light is multiplied by."""
        return self.gains[self.of_view] * self._corner[:, None]

    @property
    def _corner(self) -> Numbers:
        return np.exp(sum(part * self.radius**power for part, power in zip(self.falloff, POWERS, strict=True)))

    def fitted(self, rows: sp.csr_matrix, image: Numbers, weight: Numbers, shown: Numbers | None) -> Cameras:
        """With the factors that photographs call for.

        Args:
            rows: (P, N) view weights.
            image: (P, 3) pixels.
            weight: (P,) theirs.
            shown: (P, 3) what they would be under factors of 1; None before anything is known of it.
        """
        cameras = self
        if self.vignetting:
            means = _Means.of(rows, image.mean(axis=1), self.of_view, weight)
            falloff = means.factors(self._powers(rows, weight), free=self.exposure != "same")[1]
            cameras, shown = replace(self, falloff=falloff), None
        if self.exposure == "same":
            return cameras
        even = image / cameras._corner[:, None]
        if self.exposure == "free":
            even, shown = even.mean(axis=1, keepdims=True), None if shown is None else shown.mean(axis=1, keepdims=True)
        gains = [cameras._gains(rows, even, weight, shown, channel) for channel in range(even.shape[1])]
        return replace(cameras, gains=np.broadcast_to(np.stack(gains, axis=1), self.gains.shape))

    def _gains(
        self, rows: sp.csr_matrix, even: Numbers, weight: Numbers, shown: Numbers | None, channel: int
    ) -> Numbers:
        """(V,) factors of one channel of pixels (P, C)."""
        pixels, count = even[:, channel], len(self.gains)
        if shown is None:
            return _Means.of(rows, pixels, self.of_view, weight).factors([], free=True)[0]
        light = shown[:, channel]
        over, under = (np.bincount(self.of_view, weight * values, count) for values in (pixels * light, light**2))
        gains = np.log(np.where(over > 0.0, over, 1.0) / np.where(over > 0.0, under, 1.0))
        return np.exp(gains - gains.mean())

    def _powers(self, rows: sp.csr_matrix, weight: Numbers) -> list[Numbers]:
        """(V, N) means of each power of r² over the pixels that show a surfel."""
        return [_mean(rows, self.radius**power, self.of_view, weight) for power in POWERS]


def _squared_radius(view: View) -> Numbers:
    camera = view.camera
    x, y = np.meshgrid(np.arange(camera.width) + 0.5 - camera.cx, np.arange(camera.height) + 0.5 - camera.cy)
    squared = (x**2 + y**2).reshape(-1)
    return squared / squared.max()


def _mean(rows: sp.csr_matrix, values: Numbers, of_view: NDArray[np.intp], weight: Numbers) -> Numbers:
    """(V, N) means of values (P,) over the pixels of each photograph that show each surfel."""
    views = _by_view(of_view, weight)
    return (views @ rows.multiply(values[:, None]).tocsr()).toarray() / np.maximum((views @ rows).toarray(), 1e-12)


def _by_view(of_view: NDArray[np.intp], weight: Numbers) -> sp.csr_matrix:
    """(V, P) the pixels' weights in the row of their photograph."""
    return sp.csr_matrix((weight, (of_view, np.arange(len(weight)))), (int(of_view.max()) + 1, len(of_view)))


@dataclass(frozen=True, eq=False)
class _Means:
    """What photographs show of surfels.

    Attributes:
        logs: (V, N) l.
        counted: (V, N) how many pixels say so; 0 where too few.
    """

    logs: Numbers
    counted: Numbers

    @classmethod
    def of(cls, rows: sp.csr_matrix, grey: Numbers, of_view: NDArray[np.intp], weight: Numbers) -> _Means:
        shown = (_by_view(of_view, weight) @ rows).toarray()
        mean = _mean(rows, grey, of_view, weight)
        counted = np.where((shown >= 1.0) & (mean > 0.0), shown, 0.0)
        return cls(np.log(np.where(counted > 0.0, mean, 1.0)), counted)

    def factors(self, columns: Sequence[Numbers], *, free: bool) -> tuple[Numbers, Numbers]:
        """(V,) gains of mean logarithm 0, 1 where they are not `free`, and a coefficient of each column (V, N)."""
        own = [self._centred(column) for column in columns]
        logs, count = self._centred(self.logs), len(self.logs)
        laplacian = np.diag(self.counted.sum(axis=1)) - (self.counted / self._total) @ self.counted.T
        across = np.array([(self.counted * column).sum(axis=1) for column in own]).reshape(len(own), count)
        within = np.array([[(self.counted * a * b).sum() for a in own] for b in own]).reshape(len(own), len(own))
        matrix = np.block([[laplacian, across.T], [across, within]])
        right = np.array([*(self.counted * logs).sum(axis=1), *((self.counted * a * logs).sum() for a in own)])
        kept = slice(None) if free else slice(count, None)
        solved = np.zeros(len(right))
        solved[kept] = np.linalg.lstsq(matrix[kept, kept], right[kept], rcond=1e-9)[0]
        return np.exp(solved[:count] - solved[:count].mean()), solved[count:]

    @property
    def _total(self) -> Numbers:
        return np.maximum(self.counted.sum(axis=0), 1e-12)

    def _centred(self, values: Numbers) -> Numbers:
        """Less the mean over the photographs, surfel by surfel."""
        return values - (self.counted * values).sum(axis=0) / self._total
