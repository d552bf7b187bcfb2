"""Whether poses and depth agree: the points that one view measures, put into the depth of others.

A point that lands on the other view's depth agrees; one that lands before it contradicts, as the other camera looked
through the place; one behind it may be hidden and says nothing. Neither does one that both cameras see in the same
direction, where any depth would agree.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.views import View
from rgspipe.evidence.readings import READINGS, Numbers, Pixels, PlacedView, Reading
from rgspipe.training.initialise.depth_noise import relative_noise

#: Views that are looked at, evenly spaced; pixels of each, and other views that each of these is put into.
VIEWS, POINTS, PARTNERS = 100, 100, 16

#: Views of which noise is measured.
NOISE_VIEWS = 8

#: Half floats, and depth in millimetres, round by up to this part, in each of two views.
ROUNDING = 1e-3

#: Pixels by which a point's place must differ from where it would be infinitely far away: it may fall into any pixel
#: beside its own.
LEAST_PARALLAX = 2.0

#: The pixels around one, and itself.
AROUND = np.array([(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1)])


@dataclass(frozen=True)
class Agreement:
    """How a reading does.

    Attributes:
        agreeing, contradicting: (V,) points of each view.
    """

    agreeing: Pixels
    contradicting: Pixels

    @property
    def scores(self) -> Numbers:
        """(V,) points that agree over those that contradict, of those that could."""
        return (self.agreeing - self.contradicting) / (POINTS * PARTNERS)

    @property
    def tested(self) -> int:
        """Points that either agree or contradict."""
        return int(self.agreeing.sum() + self.contradicting.sum())

    @property
    def share(self) -> float:
        """Part of those that agree; 0 without any."""
        return float(self.agreeing.sum()) / max(self.tested, 1)


@dataclass(frozen=True)
class SharedPlaces:
    """Points of one view that lie on the depth of another.

    Attributes:
        view, other: which.
        source, target: rows and columns (N,) at which they show them.
    """

    view: int
    other: int
    source: tuple[Pixels, Pixels]
    target: tuple[Pixels, Pixels]


@dataclass(frozen=True)
class Trials:
    """Which points of which views are put into which others; the same for every reading.

    Attributes:
        views: with depth.
        along_rays: whether their files state depth along rays.
        pixels: of each view, rows and columns (POINTS,).
        partners: (V, ≤ PARTNERS) other views.
        tolerance: part of its depth by which a point may miss.
    """

    views: Sequence[View]
    along_rays: bool
    pixels: Sequence[tuple[Pixels, Pixels]]
    partners: Pixels
    tolerance: float

    @classmethod
    def draw(cls, views: Sequence[View], along_rays: bool, seed: int = 0) -> Trials:
        """At most VIEWS of the views, which have depth that is known somewhere."""
        chosen = [views[index] for index in _spread(len(views), VIEWS)]
        generator = np.random.default_rng(seed)
        pixels = [_known_pixels(view, generator) for view in chosen]
        count = len(chosen)
        others = [generator.permutation(np.delete(np.arange(count), index))[:PARTNERS] for index in range(count)]
        noise = [relative_noise(chosen[index].depth.numpy()) for index in _spread(count, NOISE_VIEWS)]
        tolerance = ROUNDING + 3.0 * math.sqrt(2.0) * float(np.median(noise))
        return cls(chosen, along_rays, pixels, np.array(others), tolerance)

    def agreement(self, reading: Reading) -> Agreement:
        """How the views' depths agree under a reading."""
        placed = [PlacedView.of(view, reading, self.along_rays) for view in self.views]
        points = np.stack([view.points(*at) for view, at in zip(placed, self.pixels, strict=True)])
        origins = np.stack([view.pose[:3, 3] for view in placed])
        counts = np.zeros((2, len(placed)), np.int64)
        for target, view in enumerate(placed):
            sources = (self.partners == target).any(axis=1).nonzero()[0]
            seen = points[sources].reshape(-1, 3)
            found = _outcomes(view, seen, origins[sources].repeat(POINTS, axis=0), self.tolerance)
            for kind, outcome in enumerate(found):
                counts[kind, sources] += outcome.reshape(len(sources), POINTS).sum(axis=1)
        return Agreement(*counts)

    def shared(self) -> Iterator[SharedPlaces]:
        """What pairs of views both show, by the files' own reading."""
        placed = [PlacedView.of(view, READINGS[0], self.along_rays) for view in self.views]
        for view, (rows, columns) in enumerate(self.pixels):
            points = placed[view].points(rows, columns)
            origins = placed[view].pose[None, :3, 3].repeat(POINTS, axis=0)
            for other in self.partners[view]:
                agrees, _ = _outcomes(placed[other], points, origins, self.tolerance)
                row, column, _ = placed[other].project(points[agrees])
                yield SharedPlaces(view, int(other), (rows[agrees], columns[agrees]), (row, column))


def _outcomes(
    view: PlacedView, points: Numbers, origins: Numbers, tolerance: float
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """(N,) which points (N, 3), seen from `origins` (N, 3), agree with the view's depth, and which contradict it."""
    row, column, depth = view.project(points)
    # Where other cameras look, few of the points are in the image: the rest costs nothing more.
    shown = (row >= 0).nonzero()[0]
    shown = shown[_parallax(view, points[shown], origins[shown]) > LEAST_PARALLAX]
    depth, (height, width) = depth[shown], view.depth.shape
    rows = (row[shown, None] + AROUND[:, 0]).clip(0, height - 1)
    columns = (column[shown, None] + AROUND[:, 1]).clip(0, width - 1)
    around = view.depth_at(rows, columns)
    known = np.isfinite(around)
    # The point may fall anywhere within the pixel, and the surface lean as it does from pixel to pixel.
    nearest = np.where(known, around, np.inf).min(axis=1) * (1.0 - tolerance)
    farthest = np.where(known, around, -np.inf).max(axis=1) * (1.0 + tolerance)
    surface, void = known.any(axis=1), np.isposinf(around).all(axis=1)
    agrees, contradicts = np.zeros((2, len(points)), np.bool_)
    agrees[shown] = surface & (depth >= nearest) & (depth <= farthest)
    contradicts[shown] = void | (surface & (depth < nearest))
    return agrees, contradicts


def _parallax(view: PlacedView, points: Numbers, origins: Numbers) -> Numbers:
    """(N,) pixels between where the view sees points and where it would if they were infinitely far from `origins`."""
    first, second = points - origins, points - view.pose[:3, 3]
    across = np.linalg.norm(np.cross(first, second), axis=1)
    lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    return view.camera.fx * across / np.maximum(lengths, 1e-300)


def _known_pixels(view: View, generator: np.random.Generator) -> tuple[Pixels, Pixels]:
    """Rows and columns of POINTS pixels of known depth, some of them twice where there are few."""
    places = view.depth.isfinite().numpy().reshape(-1).nonzero()[0]
    drawn = generator.choice(places, POINTS, replace=len(places) < POINTS)
    return drawn // view.camera.width, drawn % view.camera.width


def _spread(count: int, most: int) -> list[int]:
    """At most so many of the numbers below `count`, evenly spaced."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, most))})
