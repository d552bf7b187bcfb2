"""Pixels that may be a lamp's own: compact, and brighter than reflections are beside what surrounds them.

A reflection of a lamp at distance δ from a surface is brighter than its surroundings by (1 + t²/δ²)^1.5 at distance t,
so it is bright only where it is wide, and its brightness ends smoothly. A lamp ends within a pixel or two.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rgspipe.fitting.in_sight.lamp import BESIDE, LampInSight, Mask, grown, parts
from rgspipe.fitting.in_sight.sight import Numbers, Sight

#: Surroundings lie between `BESIDE` pixels and so many from what they surround.
AROUND = 5

#: A lamp's pixels are brighter than its surroundings grow towards it: what is farther than `BESIDE` pixels …
LEVELS = 0.75


@dataclass(frozen=True)
class Bar:
    """How much brighter, albedo apart, a lamp's pixels are than others of the view, and than what is around them.

    Attributes:
        view: times as bright as the view …
        compact: … apart from this share of it, the brightest: no lamp covers more.
        around: times as bright as the surroundings.
    """

    view: float
    compact: float
    around: float


#: What is saturated may be a lamp if it is so many times as bright as the surroundings, or as lights elsewhere make it:
#: it may be brighter than it looks.
SATURATED = 1.25

#: What is saturated, or does not light the scene, has to cover so many pixels.
LEAST_PIXELS = 3

#: What no reflection is, and what one may be where no lights explain the images.
SURE, POSSIBLE = Bar(view=8.0, compact=0.1, around=6.0), Bar(view=3.0, compact=0.35, around=2.0)


def suspects(views: Sequence[Sight], images: Sequence[Numbers], least: float, bar: Bar) -> list[LampInSight]:
    """What is brighter than reflections are, of all views.

    Args:
        images: (H, W) mean radiance of the channels, one a view.
        least: intensity that at least comes from a lamp.
    """
    pairs = zip(views, images, strict=True)
    return [lamp for index, (sight, image) in enumerate(pairs) for lamp in _suspects(index, sight, image, least, bar)]


def _suspects(index: int, sight: Sight, image: Numbers, least: float, bar: Bar) -> Iterator[LampInSight]:
    shading = shaded(sight, image)
    level = usual(sight, shading, bar.compact)
    # Where most of a view is dark, what is lit says nothing of lamps.
    bright = (shading > bar.view * level) & (level > 0.0)
    for core in parts(bright) if bright.any() else ():
        sends = sent(sight, image, core) >= least
        if sends and np.median(shading[core]) >= bar.around * _around(sight, shading, core, bright):
            yield LampInSight(index, core, grown(core, BESIDE))


def saturated(views: Sequence[Sight], images: Sequence[Numbers], full: Sequence[Mask]) -> list[LampInSight]:
    """What is saturated, and how bright is not known, in all views.

    Args:
        full: (H, W) bool, one a view, pixels that are saturated.
    """
    triples = zip(views, images, full, strict=True)
    return [
        lamp for index, (sight, image, most) in enumerate(triples) for lamp in _saturated(index, sight, image, most)
    ]


def _saturated(index: int, sight: Sight, image: Numbers, full: Mask) -> Iterator[LampInSight]:
    shading = shaded(sight, image)
    for core in parts(full & sight.surface) if full.any() else ():
        compact = LEAST_PIXELS <= core.sum() <= POSSIBLE.compact * core.size
        if compact and np.median(shading[core]) >= SATURATED * _around(sight, shading, core, full):
            yield LampInSight(index, core, grown(core, BESIDE))


def shaded(sight: Sight, image: Numbers) -> Numbers:
    """(H, W) radiance over albedo; 0 where no surface of the scene is."""
    return np.where(sight.surface, image / sight.albedo, 0.0)


def usual(sight: Sight, shading: Numbers, compact: float) -> float:
    """What all but a `compact` share of a view's `shading` (H, W) is below."""
    return float(np.quantile(shading[sight.surface], 1.0 - compact)) if sight.surface.any() else 0.0


def sent(sight: Sight, excess: Numbers, pixels: Mask) -> float:
    """The most intensity that `pixels` can be the image of: that of a lamp right before the surface behind them.

    Args:
        excess: (H, W) radiance that is the lamp's.
    """
    near = grown(pixels, BESIDE) & sight.surface
    if not near.any():
        return 0.0
    distance = float(sight.distance[near].max())
    return float((excess * sight.angle)[pixels].clip(min=0.0).sum()) * distance**2


def _around(sight: Sight, shading: Numbers, core: Mask, striking: Mask) -> float:
    """How bright it is around a suspect: that of three quarters of the pixels there, other suspects apart."""
    ring = grown(core, AROUND) & ~grown(core, BESIDE) & sight.surface & ~striking
    return float(np.quantile(shading[ring], LEVELS)) if ring.any() else np.inf
