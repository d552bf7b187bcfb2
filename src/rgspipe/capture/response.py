"""The camera's own curve, by surfaces that photographs of known and different exposures share.

An image was decoded by a curve that need not be its camera's. Its light is then I exp(−r(x)), x = log₂ of I over the
radiance of white, with one r for the camera. In the means l_vic of the logarithm over the pixels of photograph v that
show surfel i in channel c, exposures taken away,

    l_vic = r(x_vic) + log L_ic ,

log L_ic is eliminated, and r is linear between stops (Debevec and Malik 1997, who have one pose and all levels). Where
exposures are alike, so are the levels of a surface in all photographs, and r falls out of the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rgspipe.capture.photographs import Numbers, PixelsOfView, TracedPhotograph

#: Stops below white between which r is linear.
STOPS = np.arange(-8.0, 1.0)

#: Curves of cameras bend by less than this from stop to stop, and a pixel's logarithm is known to this: what a second
#: difference of r counts over a pixel is the square of their ratio. It decides only where no pixel does.
BEND, PIXEL = 0.3, 0.05


@dataclass(frozen=True, eq=False)
class Response:
    """A curve.

    Attributes:
        logs: (K,) r at STOPS, of mean 0: a factor of all light is in the radiance.
    """

    logs: Numbers

    @classmethod
    def as_decoded(cls) -> Response:
        """The curve that images were decoded by."""
        return cls(np.zeros(len(STOPS)))

    def light(self, photograph: PixelsOfView) -> Numbers:
        """(P, 3) what the pixels of a photograph tell of the light."""
        return photograph.image * np.exp(-_shares(photograph) @ self.logs)

    def fitted(self, photographs: Sequence[TracedPhotograph], weights: Sequence[Numbers]) -> Response:
        """With pixels that count by `weights`, (P,) of each photograph."""
        surfels, width = photographs[0].operator.shape[1], len(STOPS)
        matrix, right = np.zeros((width, width)), np.zeros(width)
        total, mean_shares, mean_logs = np.zeros((3, surfels)), np.zeros((3, surfels, width)), np.zeros((3, surfels))
        for photograph, weight in zip(photographs, weights, strict=True):
            for channel, (counted, shares, logs) in enumerate(_means(photograph, weight)):
                matrix += shares.T @ (counted[:, None] * shares)
                right += shares.T @ (counted * logs)
                total[channel] += counted
                mean_shares[channel] += counted[:, None] * shares
                mean_logs[channel] += counted * logs
        scaled = mean_shares / np.maximum(total, 1e-12)[..., None]
        matrix -= np.einsum("cnk,cnl->kl", scaled, mean_shares)
        right -= np.einsum("cnk,cn->k", scaled, mean_logs)
        bends = np.diff(np.eye(width), 2, axis=0)
        matrix += (PIXEL / BEND) ** 2 * bends.T @ bends
        logs = np.linalg.lstsq(matrix, right, rcond=1e-12)[0]
        return replace(self, logs=logs - logs.mean())


def _means(photograph: TracedPhotograph, weight: Numbers) -> list[tuple[Numbers, Numbers, Numbers]]:
    """For each channel what pixels (N,) show a surfel, and means over them: shares of STOPS (N, K) and logarithms."""
    back, image, shares = photograph.rows.T, photograph.image, _shares(photograph)
    found = []
    for channel in range(3):
        own = weight * (image[:, channel] > 0.0)
        logs = np.log(np.where(image[:, channel] > 0.0, image[:, channel], 1.0))
        shown = back @ own
        sums = back @ (own[:, None] * np.column_stack([shares[:, channel], logs]))
        means = sums / np.maximum(shown, 1e-12)[:, None]
        found.append((np.where(shown >= 1.0, shown, 0.0), means[:, :-1], means[:, -1]))
    return found


def _shares(photograph: PixelsOfView) -> Numbers:
    """(P, 3, K) what each pixel has of the value at each of STOPS."""
    white = photograph.view.saturated_from
    level = np.log2(np.maximum(photograph.image / white, 2.0 ** STOPS[0]))
    return np.maximum(1.0 - np.abs(np.minimum(level, 0.0)[..., None] - STOPS), 0.0)
