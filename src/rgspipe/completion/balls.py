"""Balls of which a part was seen.

On a ball about m of radius R a place p and its normal n obey p = m + R n: four unknowns, of which each surfel tells by
how far it is from m, and by where it faces. Places are known far better than normals, so each kind counts by its own
variance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.completion.rasters import Continued
from rgspipe.renderer.point_sets import fibonacci_directions

#: Angles [rad]: by which normals may leave the ball's own, and over which they must spread across where they spread
#: most. Those of a drum that are that near spread over twice the first; this is half as much again.
ASKEW = np.radians(10.0)
SPREAD = 3.0 * ASKEW

#: How far surfels may be from a ball, and by how much its own surface may be in doubt (a standard deviation) anywhere,
#: in distances of neighbours.
OFF, DOUBT = 0.5, 0.5

#: Fewest surfels of a ball: three for each of its unknowns.
FEWEST = 12

#: Neighbours with which a surfel tells a ball, and how much of their squared distances it must explain.
NEIGHBOURS, EXPLAINED = 8, 0.8

#: Balls that are tried at once, and rounds of fitting.
TRIED, ROUNDS = 128, 10

#: Medians of chi-squared with one degree of freedom and with two.
MEDIAN, MEDIAN_OF_TWO = 0.455, 1.386


@dataclass(frozen=True)
class SeenBall:
    """A ball that some surfels lie on.

    Attributes:
        middle: (3,).
        radius: scene units.
        members: (M,) int64 indices of the surfels.
    """

    middle: np.ndarray
    radius: float
    members: np.ndarray

    def all_around(self, spacing: float) -> Continued:
        """Places on all of it, a distance of neighbours apart."""
        normals = _evenly(round(4.0 * np.pi * (self.radius / spacing) ** 2))
        return Continued(self.middle + self.radius * normals, normals)


def balls_among(centers: np.ndarray, normals: np.ndarray, spacing: float) -> list[SeenBall]:
    """Those among surfels at `centers` (N, 3), the one with most first; no surfel is of two."""
    rest, found = np.arange(len(centers)), []
    while len(rest) >= FEWEST:
        ball = _best(centers, normals, rest, spacing)
        if ball is None:
            break
        found.append(ball)
        rest = np.setdiff1d(rest, ball.members)
    return found


def ball_of(centers: np.ndarray, normals: np.ndarray, members: np.ndarray, spacing: float) -> SeenBall | None:
    """The ball that most of the surfels `members` (M,) lie on; None if they lie on none, or do not tell which.

    Its members are those of them that do.
    """
    kept = members
    for _ in range(ROUNDS):
        # Surfels that face nearly alike leave open which ball it is, to rounding.
        if len(kept) < max(FEWEST, 0.5 * len(members)) or _spread(normals[kept]) < SPREAD:
            return None
        middle, radius, covariance = _fitted(centers[kept], normals[kept])
        on = _lie_on(centers[members], normals[members], middle, radius, OFF * spacing)
        kept, before = members[on], kept
        if np.array_equal(kept, before):
            ways = np.column_stack([_evenly(64), np.ones(64)])
            variance = ((ways @ covariance) * ways).sum(axis=1).max()
            return SeenBall(middle, radius, kept) if variance < (DOUBT * spacing) ** 2 else None
    return None


def _best(centers: np.ndarray, normals: np.ndarray, rest: np.ndarray, spacing: float) -> SeenBall | None:
    """The ball with most surfels among `rest`; None where there is none."""
    places, ways = centers[rest], normals[rest]
    middles, radii = _local(places, ways)
    tried = np.linspace(0, len(radii) - 1, min(TRIED, len(radii))).round().astype(int)
    found = [_lie_on(places, ways, middles[index], radii[index], 2.0 * OFF * spacing) for index in tried]
    for on in sorted(map(np.flatnonzero, found), key=len, reverse=True):
        if len(on) < FEWEST:
            return None
        # From the surfels around one the ball is known roughly: those near it tell it well.
        ball = ball_of(centers, normals, rest[on], spacing)
        if ball is not None:
            # Rough ones have surfels before and behind them, which are no further ball.
            whole = _lie_on(places, ways, ball.middle, ball.radius, 2.0 * OFF * spacing)
            return replace(ball, members=rest[whole])
    return None


def _local(places: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middles (K, 3) and radii (K,) of the balls on which surfels lie together with their neighbours."""
    if len(places) <= NEIGHBOURS:
        return np.empty((0, 3)), np.empty(0)
    near = cKDTree(places).query(places, k=NEIGHBOURS + 1)[1]
    middle, way = places[near].mean(axis=1), normals[near].mean(axis=1)
    moved, turned = places[near] - middle[:, None], normals[near] - way[:, None]
    # p = m + R n, less its mean.
    along, bent = (moved * turned).sum(axis=(1, 2)), (turned**2).sum(axis=(1, 2))
    radius = along / bent.clip(min=1e-12)
    explained = along * radius > EXPLAINED * (moved**2).sum(axis=(1, 2))
    chosen = explained & (radius > 0.0)
    return (middle - radius[:, None] * way)[chosen], radius[chosen]


def _lie_on(places: np.ndarray, normals: np.ndarray, middle: np.ndarray, radius: float, off: float) -> np.ndarray:
    """(P,) bool: places (P, 3) that are within `off` of a ball and face as it does there."""
    outward = places - middle
    distance = np.linalg.norm(outward, axis=1).clip(min=1e-12)
    facing = (outward * normals).sum(axis=1) / distance
    return (np.abs(distance - radius) < off) & (facing > np.cos(ASKEW))


def _fitted(places: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Middle (3,) and radius of the ball on which surfels lie, and the covariance (4, 4) of both (Gauss-Newton)."""
    count = len(places)
    linear = np.concatenate([np.broadcast_to(np.eye(3), (count, 3, 3)), normals[:, :, None]], axis=2)
    solved = np.linalg.lstsq(linear.reshape(-1, 4), places.reshape(-1), rcond=None)[0]
    for _ in range(ROUNDS):
        outward = places - solved[:3]
        distance = np.linalg.norm(outward, axis=1, keepdims=True).clip(min=1e-12)
        outward /= distance
        across = np.eye(3) - outward[:, :, None] * outward[:, None]
        off, askew = distance[:, 0] - solved[3], (across @ normals[:, :, None])[:, :, 0]
        place = max(np.median(off**2) / MEDIAN, (1e-9 * solved[3]) ** 2)
        turn = max(np.median((askew**2).sum(axis=1)) / MEDIAN_OF_TWO, 1e-18)
        # A place that is off by more than three deviations counts less (Huber).
        heeded = np.minimum(1.0, 3.0 * np.sqrt(place) / np.abs(off).clip(min=1e-300)) / place
        of_place = -np.column_stack([outward, np.ones(count)])
        of_normal = across / distance[:, :, None]
        matrix = (of_place * heeded[:, None]).T @ of_place
        matrix[:3, :3] += np.einsum("kia,kib->ab", of_normal, of_normal) / turn
        right = (of_place * heeded[:, None]).T @ off
        right[:3] += np.einsum("kia,ki->a", of_normal, askew) / turn
        solved = solved - np.linalg.solve(matrix, right)
    return solved[:3], float(solved[3]), np.linalg.inv(matrix)


def _spread(normals: np.ndarray) -> float:
    """The angle [rad] over which unit normals (M, 3) spread in the direction in which they do least."""
    middle = normals.mean(axis=0)
    middle /= np.linalg.norm(middle).clip(min=1e-12)
    flat = normals - (normals @ middle)[:, None] * middle
    ways = np.linalg.svd(flat, full_matrices=False)[2][1]
    turned = np.arcsin((flat @ ways).clip(-1.0, 1.0))
    return float(np.ptp(turned))


def _evenly(count: int) -> np.ndarray:
    """(N, 3) unit directions."""
    return fibonacci_directions(max(count, 4)).double().numpy()
