"""Unknown exposures: a factor per view, found together with the intensities.

View v shows e_v Σ_l a_lc U_lc. The factors and the intensities have no closed form together, but each has one given the
other; with the moments of every view apart, alternating between the two never looks at a pixel again. Intensities are
those of the first view's exposure, e_1 = 1: one view alone cannot tell a factor from an intensity.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.model.moments import Moments, moments

#: Alternations end when no exposure changes by more than this share, and after so many.
SETTLED, ALTERNATIONS = 1e-10, 200

#: Exposures are kept within this factor of the first view's.
LARGEST_EXPOSURE = 1000.0

#: Directions of the eliminated unknowns with less than this share of the information are none.
RANK = 1e-12


@dataclass(frozen=True)
class ExposedMoments:
    """`Moments` of V views with unknown exposures; the same questions are answered.

    Attributes:
        by_view: (V, 3, L + D + 1, L + D + 1) float64, `Moments.values` of each view.
        owners: (D,) int64 light of each derivative.
        lights: L.
    """

    by_view: Tensor
    owners: Tensor
    lights: int

    @cached_property
    def exposures(self) -> Tensor:
        """(V,) float64 factors with the least squared error, the first 1; 1 for a view that shows no light."""
        exposures = torch.ones(len(self.by_view), dtype=torch.float64)
        for _ in range(ALTERNATIONS):
            last = exposures
            exposures = self._answer(self._at(exposures).intensity)
            if bool(((exposures - last).abs() <= SETTLED * last).all()):
                break
        return exposures

    @cached_property
    def known(self) -> Moments:
        """The moments with exposures known to be these."""
        return self._at(self.exposures)

    @property
    def intensity(self) -> Tensor:
        """(L, 3) intensities ≥ 0 with the least squared error."""
        return self.known.intensity

    @property
    def cost(self) -> float:
        """Σ w² (y − e Σ aU)² at the best intensities and exposures."""
        return self.known.cost

    def parameter_system(self) -> tuple[Tensor, Tensor]:
        """Gauss-Newton matrix (D, D) and descent direction (D,) of the parameters; all else eliminated."""
        parameters = len(self.owners)
        scaled = self._scaled(self.exposures)
        per_view = torch.stack([Moments(v, self.owners, self.lights).information(self.intensity) for v in scaled])
        # A relative change of an exposure does to its view what all intensities together do.
        relative = torch.cat([torch.zeros(parameters, dtype=torch.float64), self.intensity.reshape(-1)])
        by_exposure = (per_view @ relative)[1:]
        joint = per_view.sum(dim=0)
        lit = parameters + (self.intensity.reshape(-1) > 0).nonzero()[:, 0]
        side = torch.cat([joint[:parameters][:, lit], by_exposure[:, :parameters].T], dim=1)
        rest = torch.cat(
            [
                torch.cat([joint[lit][:, lit], by_exposure[:, lit].T], dim=1),
                torch.cat([by_exposure[:, lit], torch.diag(by_exposure @ relative)], dim=1),
            ]
        )
        scale = rest.diagonal().clamp(min=1e-300).sqrt()
        inverse = torch.linalg.pinv(rest / scale[:, None] / scale[None, :], rtol=RANK, hermitian=True)
        side = side / scale[None, :]
        return joint[:parameters, :parameters] - side @ inverse @ side.T, self.known.parameter_system()[1]

    def _at(self, exposures: Tensor) -> Moments:
        return Moments(self._scaled(exposures).sum(dim=0), self.owners, self.lights)

    def _scaled(self, exposures: Tensor) -> Tensor:
        """`by_view` with every view's columns, but not its target, times its exposure."""
        factors = exposures[:, None].expand(-1, self.by_view.shape[-1]).clone()
        factors[:, -1] = 1.0
        return self.by_view * factors[:, None, :, None] * factors[:, None, None, :]

    def _answer(self, intensity: Tensor) -> Tensor:
        """(V,) the best exposures for intensities (L, 3), over the first one."""
        count, a = self.lights, intensity.T
        square = torch.einsum("cl,vclm,cm->v", a, self.by_view[:, :, :count, :count], a)
        product = torch.einsum("cl,vcl->v", a, self.by_view[:, :, :count, -1])
        exposures = torch.where(square > 0.0, product / square.clamp(min=1e-300), 1.0)
        exposures = torch.where(exposures > 0.0, exposures, 1.0)
        return (exposures / exposures[0]).clamp(1.0 / LARGEST_EXPOSURE, LARGEST_EXPOSURE)


def moments_by_view(
    columns: Sequence[Tensor], target: Tensor, weights: Tensor, bounds: Sequence[int]
) -> ExposedMoments:
    """`moments` of V views apart.

    Args:
        columns, target, weights: as for `moments`, of the pixels of all views.
        bounds: V + 1 places; view v has the pixels from bounds[v] to bounds[v + 1].
    """
    weights = weights.expand(target.shape)
    parts = [
        moments([part[first:last] for part in columns], target[first:last], weights[first:last])
        for first, last in itertools.pairwise(bounds)
    ]
    return ExposedMoments(torch.stack([part.values for part in parts]), parts[0].owners, len(columns))


def best_factors(target: Tensor, image: Tensor, weights: Tensor, view_of: Tensor, count: int) -> Tensor:
    """(V,) factor of each view's image (P, 3) that makes it most like the target; 1 where that is none.

    Args:
        weights: (P, 3) or (P, 1) squared weights.
        view_of: (P,) int64 view of each pixel; count: V.
    """
    weighted = weights.double() * image.double()
    product, square = (
        torch.zeros(count, dtype=torch.float64, device=target.device).index_add_(0, view_of, (weighted * other).sum(1))
        for other in (target.double(), image.double())
    )
    usable = (square > 0.0) & (product > 0.0)
    return torch.where(usable, product / torch.where(usable, square, 1.0), 1.0)


def rough_exposures(images: Tensor, target: Tensor, weights: Tensor, view_of: Tensor, count: int) -> Tensor:
    """(V,) exposures over the first from the candidate whose coarse image explains most, every view by itself.

    Args:
        images: (C, B, 3) coarse images of candidates; target: (B, 3); weights: (B, 3) squared.
        view_of: (B,) int64 view of each block; count: V.
    """
    weighted = images.double() * weights.double()
    shape = (len(images), count, 3)
    product, square = (
        torch.zeros(shape, dtype=torch.float64, device=images.device).index_add_(1, view_of, weighted * other.double())
        for other in (target, images)
    )
    reached = square > 0.0
    strength = torch.where(reached, product.clamp(min=0.0) / torch.where(reached, square, 1.0), 0.0)
    best = int((strength * product).sum(dim=(1, 2)).argmax())
    # Every view's strength in terms of the first view's colour.
    colour = strength[best, 0]
    total = (square[best] * colour.square()).sum(dim=1)
    found = torch.where(total > 0.0, (product[best] * colour).sum(dim=1) / total.clamp(min=1e-300), 1.0).cpu()
    return torch.where(found > 0.0, found, 1.0).clamp(1.0 / LARGEST_EXPOSURE, LARGEST_EXPOSURE)
