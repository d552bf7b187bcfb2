"""What photographs say, and how much each of their pixels counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d

from rgspipe.datasets.views import View
from rgspipe.training.levels import levels

#: Part of a view's level below which pixels count as dark: their errors are absolute.
DARK = 0.1

#: Pixels with less surface than this say nothing of it.
MINIMUM_COVERAGE = 0.3

#: … and so do those whose alpha and coverage differ by more: there the surfels end where the object does not.
COVERAGE_MISMATCH = 0.1

#: Pixels to each side over which errors are averaged before they are judged. With none, each is judged by its own
#: noise: that of a path tracer is a few pixels that are much too bright, and without these albedo comes out too low. In
#: the room of the tests, with such noise of 60 %, it is 2.7 % too low in the mean; with one pixel 0.9 %, as with two.
AROUND = 1


@dataclass(frozen=True)
class Photographs:
    """Those of V views, of P pixels each.

    Attributes:
        images: V images (P, 3).
        sizes: V heights and widths.
        levels: V scalars that errors are measured against.
        trust: V shares (P,) to which a pixel counts before any error is known.
    """

    images: Sequence[Tensor]
    sizes: Sequence[tuple[int, int]]
    levels: Sequence[Tensor]
    trust: Sequence[Tensor]

    @classmethod
    def of(cls, views: Sequence[View], coverages: Sequence[Tensor], expected: Sequence[Tensor]) -> Photographs:
        """Those of views of which surfels cover a part (P,), and for which `levels` expects images (P, 3)."""
        images = [view.image.reshape(-1, 3).float() for view in views]
        sizes = [(view.image.shape[0], view.image.shape[1]) for view in views]
        trust = [trusted(view, coverage) for view, coverage in zip(views, coverages, strict=True)]
        return cls(images, sizes, levels(images, expected), trust)

    def weights(self, shown: Sequence[Tensor] | None = None) -> list[Tensor]:
        """V weights (P,) of squared errors where a model shows images (P, 3); the photographs until there is one.

        A photograph's own values would be wrong once there is: where noise made a pixel darker it would weigh more, so
        that all comes out too dark.
        """
        parts = zip(self.trust, shown or self.images, self.levels, strict=True)
        return [trust * relative(image, scale) for trust, image, scale in parts]

    def robust_weights(self, renders: Sequence[Tensor]) -> list[Tensor]:
        """Weights with those that fit badly weighing less: places in a view (shadow edges, occlusions), and views as a
        whole (a lamp that something unseen shades).

        A pixel fits badly that is off together with those around it by more than single pixels are, which noise does.
        """
        pixels, places = (
            [self._errors(v, render, around) for v, render in enumerate(renders)] for around in (0, AROUND)
        )
        typical = [_typical(error[trust > 0]) for error, trust in zip(pixels, self.trust, strict=True)]
        usual = _typical(torch.stack(typical)) if typical else torch.tensor(1.0)
        parts = zip(self.weights(renders), places, typical, strict=True)
        return [weight * _less(error, own) * _less(own, usual) for weight, error, own in parts]

    def _errors(self, v: int, render: Tensor, around: int) -> Tensor:
        """(P,) by how much means over so many pixels to each side differ, over the darker: shadows that the model lacks
        and those that it alone has count alike."""
        both = torch.cat([render, self.images[v]], dim=1)
        shown, told = _local_means(both, self.trust[v] > 0, self.sizes[v], around).split(3, dim=1)
        darker = torch.minimum(shown.mean(dim=1), told.mean(dim=1)).clamp(min=0.0)
        return (shown - told).abs().mean(dim=1) / (darker + DARK * self.levels[v])


def trusted(view: View, coverage: Tensor) -> Tensor:
    """(P,) 1, and 0 where surfels and photograph disagree on what is covered, which is for the geometry, and where the
    photograph is saturated."""
    alpha = view.alpha.reshape(-1).float()
    found = (coverage >= MINIMUM_COVERAGE) & ((alpha - coverage).abs() <= COVERAGE_MISMATCH)
    return (found & ~view.saturated.reshape(-1, 3).any(dim=1)).float()


def relative(shown: Tensor, scale: Tensor) -> Tensor:
    """(P,) weights of squared errors of an image that shows (P, 3), measured against the level `scale`: relative in
    bright pixels, absolute in dark, and in those that noise made negative."""
    return 1.0 / (shown.mean(dim=1).clamp(min=0.0) / scale + DARK) / scale.square()


def _local_means(values: Tensor, counted: Tensor, size: tuple[int, int], around: int) -> Tensor:
    """(P, C) means of `values` over the pixels `counted` (P,) in squares around each in an image of `size`; 0 where
    none is."""
    share = counted.to(values)[:, None]
    stacked = torch.cat([values * share, share], dim=1).T.reshape(1, -1, *size)
    summed = avg_pool2d(stacked, 2 * around + 1, stride=1, padding=around)[0].reshape(values.shape[1] + 1, -1).T
    return summed[:, :-1] / summed[:, -1:].clamp(min=1e-12)


def _typical(errors: Tensor) -> Tensor:
    """Errors that are larger are few."""
    return 3.0 * errors.median() + 1e-4 if len(errors) else torch.tensor(1.0)


def _less(error: Tensor, typical: Tensor) -> Tensor:
    return 1.0 / (1.0 + (error / typical).square())
