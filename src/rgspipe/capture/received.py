"""What surfaces receive: from each other, measured, and from lamps, with what comes back from where no camera looked.

A surfel reflects L = ρ (Σ a e + F L), F the gather operator. Of the surfels s that were seen L is known. Those that no
camera saw, u, send what they get, with the albedo that the field continues into them:

    L_u = (1 − ρ_u F_uu)⁻¹ ρ_u (Σ a e_u + F_us L_s) .

A surfel that is known in some channels only is seen in those, and unseen in the others. So all that arrives is linear
in the lamps,  Σ a T e + G ,  with  T e = e + F_·u (1 − ρ_u F_uu)⁻¹ ρ_u e_u  and G what the measured radiance becomes.

Some bounces are followed. All further ones add to a surfel what they do under light that is the same everywhere, in
proportion to the last that was followed: by then light has forgotten where it came from.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import torch
from numpy.typing import NDArray
from torch import Tensor

from rgspipe.capture.photographs import Numbers
from rgspipe.capture.side_by_side import kept_property
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.training.albedo import ALBEDO_RANGE

#: Bounces among surfels that no camera saw which are followed. In a room of albedo 0.9, half of it unseen, what arrives
#: is 0.02 % off in the median and 0.3 % at most; 0.2 and 2 % with 2 of them, 0.0002 and 0.009 % with 8.
BOUNCES = 4

#: Of the albedo of three channels and their mean, the mean.
MEAN = 3

#: What further bounces add is known once one adds no more than this part of it.
SETTLED = 1e-4


@dataclass(frozen=True, eq=False)
class FromUnseen:
    """Where the light of U surfels that no camera saw goes, in single precision, as it is most of a search's work.

    Attributes:
        among: (U, U) F_uu.
        on_all: (N, U) F_·u.
    """

    among: SparseOperator
    on_all: SparseOperator

    @classmethod
    def of(cls, gather: sp.csr_matrix, unseen: np.ndarray) -> FromUnseen:
        """Of the surfels `unseen` (U,) by the operator (N, N) of all."""
        on_all = gather[:, unseen]
        return cls(SparseOperator.from_scipy(on_all[unseen]), SparseOperator.from_scipy(on_all))

    def returned(self, arriving: Numbers, albedo: Numbers, further: Tensor) -> Numbers:
        """(N, K, C) what comes back of `arriving` (U, K, C or 1) from surfels of C kinds of `albedo` (U, C), to which
        `further` (U, C) belongs.

        All at once, as a product takes little longer for more columns.
        """
        reflected = _single(albedo)[:, None]
        first = reflected * _single(arriving)
        sent, last = self._followed(first.flatten(1), reflected.expand_as(first).flatten(1))
        sent = sent + (further[:, None] * last.reshape(first.shape)).flatten(1)
        return self.arriving(sent).reshape(-1, *first.shape[1:])

    def arriving(self, sent: Numbers) -> Numbers:
        """(N, K) what arrives of what they have `sent` (U, K)."""
        return (self.on_all @ _single(sent)).double().numpy()

    def further(self, albedo: Numbers) -> Tensor:
        """(U, K) what bounces that are not followed add to the last that is, for each albedo (U, K)."""
        reflected = _single(albedo)
        _, last = self._followed(reflected, reflected)
        bounced, rest = last, torch.zeros_like(last)
        while bounced.sum() > SETTLED * rest.sum():
            bounced = reflected * (self.among @ bounced)
            rest = rest + bounced
        return torch.where(last > 0.0, rest / last, 0.0)

    def _followed(self, sent: Tensor, reflected: Tensor) -> tuple[Tensor, Tensor]:
        """(U, K) all that is sent of what is sent at first, and the last bounce of it."""
        last = sent
        for _ in range(BOUNCES):
            last = reflected * (self.among @ last)
            sent = sent + last
        return sent, last


def _single(values: Numbers | Tensor) -> Tensor:
    return torch.as_tensor(np.ascontiguousarray(values)).float()


@dataclass(frozen=True, eq=False)
class Received:
    """Light that arrives at N surfels.

    Attributes:
        unseen: (U,) surfels whose radiance was not measured in all channels, or may not have been.
        from_unseen: where their light goes.
        told: (U, 3) bool, channels in which it was.
        albedo: (U, 3) of those; 0 in these channels.
        radiance: (U, 3) L of these.
        others: (N, 3) F_·s L_s, what arrives from all others.
        uneven: (N,) Σ_j F_ij L_j² − (F L)_i², variance of the grey radiance that each surfel looks at.
    """

    unseen: np.ndarray
    from_unseen: FromUnseen
    told: np.ndarray
    albedo: Numbers
    radiance: Numbers
    others: Numbers
    uneven: Numbers

    @classmethod
    def of(cls, gather: sp.csr_matrix, radiance: Numbers, seen: np.ndarray, albedo: Numbers) -> Received:
        """With the measured `radiance` (N, 3) where `seen` (N, 3) bool, and `albedo` (N, 3) elsewhere."""
        fully = seen.all(axis=1)
        unseen, grey = (~fully).nonzero()[0], radiance.mean(axis=1)
        others, told = gather @ np.where(fully[:, None], radiance, 0.0), seen[unseen]
        uneven = np.maximum(gather @ grey**2 - (gather @ grey) ** 2, 0.0)
        from_unseen = FromUnseen.of(gather, unseen)
        return cls(unseen, from_unseen, told, _untold(told, albedo[unseen]), radiance[unseen], others, uneven)

    def with_albedo(self, albedo: Numbers) -> Received:
        """With another albedo (N, 3); that of the seen is not looked at."""
        return replace(self, albedo=_untold(self.told, albedo[self.unseen]))

    def with_told(self, told: NDArray[np.bool_], albedo: Numbers) -> Received:
        """With other channels `told` (N, 3), of those in which the radiance may not have been measured, and albedo."""
        told = told[self.unseen]
        return replace(self, told=told, albedo=_untold(told, albedo[self.unseen]))

    @kept_property
    def known(self) -> Numbers:
        """(N, 3) G, radiance per unit albedo."""
        if not len(self.unseen):
            return self.others
        seen = self.others + self.from_unseen.arriving(np.where(self.told, self.radiance, 0.0))
        return self._spread(seen[:, None], slice(0, MEAN))[:, 0]

    @kept_property
    def _albedos(self) -> Numbers:
        """(U, 4) of the channels, and their mean."""
        return np.column_stack([self.albedo, self.albedo.mean(axis=1)])

    @kept_property
    def _further(self) -> Tensor:
        return self.from_unseen.further(self._albedos)

    def spread(self, arriving: Numbers, channel: int | None = None) -> Numbers:
        """(N, K) T e of `arriving` (N, K), with what returns from the unseen; grey if `channel` is None."""
        kind = MEAN if channel is None else channel
        return self._spread(arriving[:, :, None], slice(kind, kind + 1))[:, :, 0]

    def spread_colours(self, arriving: Numbers) -> Numbers:
        """(N, K, 3) `spread` in each channel."""
        return self._spread(arriving[:, :, None], slice(0, MEAN))

    def _spread(self, arriving: Numbers, kinds: slice) -> Numbers:
        """(N, K, C) of `arriving` (N, K, C or 1), by C kinds of albedo."""
        albedo, further = self._albedos[:, kinds], self._further[:, kinds]
        if not len(self.unseen):
            return np.repeat(arriving, albedo.shape[1] // arriving.shape[2], axis=2)
        return arriving + self.from_unseen.returned(arriving[self.unseen], albedo, further)


def _untold(told: np.ndarray, albedo: Numbers) -> Numbers:
    """`albedo` (U, 3), 0 where it is `told` (U, 3) what is sent, and no more than surfaces may reflect."""
    return np.where(told, 0.0, np.minimum(albedo, ALBEDO_RANGE[1]))
