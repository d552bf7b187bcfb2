"""What cameras did to the light: exposures, white balance, vignetting and curve, by what photographs share.

    I_p = g_vc exp(a r² + b r⁴) (W L)_pc

with one factor g a photograph v (and channel c, where white balance is free), and a, b of the lens that took all of
them; r is a pixel's distance from the principal point, 1 in the farthest corner. In the means l_vi of the logarithms
over the pixels of photograph v that show surfel i all of them are linear,

    l_vi = g_v + a r²_vi + b r⁴_vi + log L_i ,

and log L_i is eliminated. A curve of the camera's own (`capture.response`) comes before either.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rgspipe.capture.photographs import Numbers, PixelsOfView, TracedPhotograph
from rgspipe.capture.response import Response
from rgspipe.names import Exposure

#: Powers of r² in the vignetting.
POWERS = (1, 2)


@dataclass(frozen=True, eq=False)
class Cameras:
    """Factors of V photographs, and what of them is free.

    Attributes:
        exposure, vignetting: what is not known.
        gains: (V, 3) g, of mean logarithm 0 in each channel.
        falloff: (2,) a, b.
        response: the curve; None where images are linear as they were decoded.
    """

    exposure: Exposure
    vignetting: bool
    gains: Numbers
    falloff: Numbers
    response: Response | None = None

    @classmethod
    def of(cls, count: int, exposure: Exposure, vignetting: bool, bent: bool = False) -> Cameras:
        """All alike, before anything is known; `bent` ones have a curve of their own."""
        curve = Response.as_decoded() if bent else None
        return cls(exposure, vignetting, np.ones((count, 3)), np.zeros(2), curve)

    def even(self, photographs: Sequence[TracedPhotograph]) -> Iterator[Numbers]:
        """(P, 3) of each photograph what it would show under factors of 1."""
        for index, photograph in enumerate(photographs):
            yield self.evened(index, photograph)

    def evened(self, index: int, photograph: PixelsOfView) -> Numbers:
        """(P, 3) what photograph `index` would show under a factor of 1."""
        return self._light(photograph) / (self.gains[index] * self._corner(photograph))

    def _light(self, photograph: PixelsOfView) -> Numbers:
        """(P, 3) as the curve has it."""
        return photograph.image if self.response is None else self.response.light(photograph)

    def _corner(self, photograph: PixelsOfView) -> Numbers:
        """(P, 1) what the lens leaves of the light."""
        if not self.vignetting:
            return np.ones((1, 1))
        squared = photograph.squared_radius
        return np.exp(sum(part * squared**power for part, power in zip(self.falloff, POWERS, strict=True)))[:, None]

    def fitted(
        self, photographs: Sequence[TracedPhotograph], weights: Sequence[Numbers], radiance: Numbers | None
    ) -> Cameras:
        """With the factors that photographs call for.

        Args:
            weights: (P,) of the pixels of each.
            radiance: (N, 3) of the surfels; None before anything is known of it.
        """
        cameras = self
        if self.response is not None:
            cameras, radiance = replace(self, response=self.response.fitted(photographs, weights)), None
        if self.vignetting:
            grey = (cameras._light(photograph).mean(axis=1) for photograph in photographs)
            means = Means.of(photographs, grey, weights)
            equations = means.equations(_powers(photographs, weights))
            falloff = equations.solved(free=self.exposure != "same")[1]
            cameras, radiance = replace(cameras, falloff=falloff), None
        if self.exposure == "same":
            return cameras
        return replace(cameras, gains=cameras._gains(photographs, weights, radiance))

    def _gains(
        self, photographs: Sequence[TracedPhotograph], weights: Sequence[Numbers], radiance: Numbers | None
    ) -> Numbers:
        """(V, 3) factors."""
        if radiance is None:
            return np.stack([self._first_gains(photographs, weights, channel) for channel in range(3)], axis=1)
        over, under = np.zeros_like(self.gains), np.zeros_like(self.gains)
        for index, (photograph, weight) in enumerate(zip(photographs, weights, strict=True)):
            light = self._seen_as_one(photograph.rows @ radiance)
            pixels = self._seen_as_one(self._light(photograph) / self._corner(photograph))
            over[index], under[index] = weight @ (pixels * light), weight @ light**2
        gains = np.log(np.where(over > 0.0, over, 1.0) / np.where(over > 0.0, under, 1.0))
        return np.exp(gains - gains.mean(axis=0))

    def _first_gains(
        self, photographs: Sequence[TracedPhotograph], weights: Sequence[Numbers], channel: int
    ) -> Numbers:
        """(V,) factors of a channel by the surfels that photographs share."""
        pixels = (
            self._seen_as_one(self._light(photograph) / self._corner(photograph))[:, channel]
            for photograph in photographs
        )
        return np.exp(Means.of(photographs, pixels, weights).equations([]).solved(free=True)[0])

    def _seen_as_one(self, colours: Numbers) -> Numbers:
        """(P, 3) colours, grey where all channels have one factor."""
        if self.exposure == "free_colour":
            return colours
        return np.repeat(colours.mean(axis=1, keepdims=True), 3, axis=1)


def _powers(photographs: Sequence[TracedPhotograph], weights: Sequence[Numbers]) -> list[Numbers]:
    """(V, N) means of each power of r² over the pixels that show a surfel."""
    pairs = zip(photographs, weights, strict=True)
    means = np.stack([mean_shown(photograph, radial(photograph), weight)[0] for photograph, weight in pairs])
    return list(np.moveaxis(means, 2, 0))


def radial(photograph: PixelsOfView) -> Numbers:
    """(P, C) powers of r² of the pixels."""
    return np.stack([photograph.squared_radius**power for power in POWERS], axis=1)


def mean_shown(photograph: TracedPhotograph, values: Numbers, weight: Numbers) -> tuple[Numbers, Numbers]:
    """(N, K) means of values (P, K) over the pixels that show each surfel, and (N,) how many do."""
    back = photograph.rows.T
    shown = back @ weight
    return (back @ (weight[:, None] * values)) / np.maximum(shown, 1e-12)[:, None], shown


@dataclass(frozen=True, eq=False)
class Means:
    """What photographs show of surfels.

    Attributes:
        logs: (V, A) l.
        counted: (V, A) how many pixels say so; 0 where too few.
    """

    logs: Numbers
    counted: Numbers

    @classmethod
    def of(
        cls, photographs: Sequence[TracedPhotograph], pixels: Iterable[Numbers], weights: Sequence[Numbers]
    ) -> Means:
        """Of all surfels, by `pixels` (P,) of each photograph."""
        triples = zip(photographs, pixels, weights, strict=True)
        parts = [mean_shown(photograph, one[:, None], weight) for photograph, one, weight in triples]
        mean, shown = (np.stack(part) for part in zip(*parts, strict=True))
        return cls.counting(mean[:, :, 0], shown)

    @classmethod
    def counting(cls, mean: Numbers, shown: Numbers) -> Means:
        """By the means (V, A) over so many pixels (V, A)."""
        counted = np.where((shown >= 1.0) & (mean > 0.0), shown, 0.0)
        return cls(np.log(np.where(counted > 0.0, mean, 1.0)), counted)

    def part(self, kept: NDArray[np.bool_]) -> Means:
        """Of some of the surfels, (A,) bool."""
        return Means(self.logs[:, kept], self.counted[:, kept])

    def equations(self, columns: Sequence[Numbers]) -> Equations:
        """With a coefficient of each column (V, A)."""
        own = [self._centred(column) for column in columns]
        logs, count = self._centred(self.logs), len(self.logs)
        laplacian = np.diag(self.counted.sum(axis=1)) - (self.counted / self._total) @ self.counted.T
        across = np.array([(self.counted * column).sum(axis=1) for column in own]).reshape(len(own), count)
        within = np.array([[(self.counted * a * b).sum() for a in own] for b in own]).reshape(len(own), len(own))
        matrix = np.block([[laplacian, across.T], [across, within]])
        right = np.array([*(self.counted * logs).sum(axis=1), *((self.counted * a * logs).sum() for a in own)])
        return Equations(matrix, right, count)

    @property
    def _total(self) -> Numbers:
        return np.maximum(self.counted.sum(axis=0), 1e-12)

    def _centred(self, values: Numbers) -> Numbers:
        """Less the mean over the photographs, surfel by surfel."""
        return values - (self.counted * values).sum(axis=0) / self._total


@dataclass(frozen=True, eq=False)
class Equations:
    """Normal equations of V gains' logarithms and C coefficients; those of parts of the surfels add up.

    Attributes:
        matrix, right: (V + C, V + C) and (V + C,).
        count: V.
    """

    matrix: Numbers
    right: Numbers
    count: int

    def __add__(self, other: Equations) -> Equations:
        return replace(self, matrix=self.matrix + other.matrix, right=self.right + other.right)

    def __sub__(self, other: Equations) -> Equations:
        return replace(self, matrix=self.matrix - other.matrix, right=self.right - other.right)

    def solved(self, *, free: bool) -> tuple[Numbers, Numbers]:
        """(V,) logarithms of mean 0, 0 where gains are not `free`, and (C,) coefficients."""
        kept = slice(None) if free else slice(self.count, None)
        solved = np.zeros(len(self.right))
        solved[kept] = np.linalg.lstsq(self.matrix[kept, kept], self.right[kept], rcond=1e-9)[0]
        gains, coefficients = np.split(solved, [self.count])
        return gains - gains.mean(), coefficients
