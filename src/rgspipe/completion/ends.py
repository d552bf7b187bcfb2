"""Where faces end: at the other faces of their thing.

Surfels overlap, so one beside an edge hangs over it, by more than a distance of surfels where a guessed face was laid
down to the edge; a lamp behind a thing then has a shadow that is too wide, and is taken to stand farther from it. Two
faces that a thing turns outwards lie behind each other's planes, so each is cut at the plane of the other.

Surfels that cameras saw are cut by depth and photographs already (`training.initialise.edges`, `training.refine`), each
for itself: of those along an edge the ones that reach farthest cast its shadow, a fifteenth of a distance too wide.
Planes are known far better, so where two of them meet that were seen they say where the edge is, unless what is across
is no plane to speak of, as along rims and legs, where each surfel is turned another way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.completion.rasters import ACROSS
from rgspipe.scene.surfels import NO_CLIP

#: Surfels of other faces are looked for so far from a surfel, and those of the two faces to tell how these lie to each
#: other, in distances of surfels.
NEAR, AROUND = 2.5, 4.0

#: What goes on past a surfel's end is no more than so many distances aside: a row of surfels beside its own.
ASIDE = 1.0

#: Surfels on one plane are within so many distances of it.
ON_PLANE = 0.5

#: A face that goes on so many distances past another's plane does not end there.
GOES_ON = 2.0

#: Ends of a surfel whose directions are within this angle [rad] are at one edge.
TURN = np.radians(20.0)

#: An edge of what was seen is known if the plane across is, to so many distances there: as wide as surfels fade out.
KNOWN = 0.12

#: Edges a surfel can have.
MOST = 2

#: Surfels that are looked at together.
AT_ONCE = 4096


@dataclass(frozen=True)
class Ends:
    """How N surfels end.

    Attributes:
        kept: (N,) bool: not guessed ones whose middle is past an end.
        offsets, angles: (N, 2) as of `Surfels`; NO_CLIP and 0 where there is no end.
    """

    kept: np.ndarray
    offsets: np.ndarray
    angles: np.ndarray


#: An end: how far it is from a surfel's centre, in distances of neighbours, and its (3,) outward direction.
End = tuple[float, np.ndarray]


def ends(
    centers: np.ndarray,
    normals: np.ndarray,
    axes: np.ndarray,
    offsets: np.ndarray,
    angles: np.ndarray,
    seen: int,
    spacing: float,
) -> Ends:
    """Of surfels at `centers` (N, 3) with unit `normals` (N, 3), of which cameras saw the first `seen`.

    Args:
        axes: (N, 2, 3) in-plane axes u and v.
        offsets, angles: (N, 2) how they end as far as is known, as of `Surfels`.
        spacing: distance of neighbours.
    """
    count = len(centers)
    found = Ends(np.ones(count, dtype=bool), np.full((count, MOST), NO_CLIP), np.zeros((count, MOST)))
    outward = np.cos(angles)[..., None] * axes[:, :1] + np.sin(angles)[..., None] * axes[:, 1:]
    tree = cKDTree(centers)
    for first in range(0, count, AT_ONCE):
        chosen = np.arange(first, min(first + AT_ONCE, count))
        lists = tree.query_ball_point(centers[chosen], AROUND * spacing, return_sorted=True)
        for own, near in zip(chosen, lists, strict=True):
            around = np.asarray(near)
            away = (centers[around] - centers[own]) / spacing
            known = [(offsets[own, k] / spacing, outward[own, k]) for k in np.flatnonzero(offsets[own] < NO_CLIP)]
            # What is guessed may be wrong, and tells of others that were seen no more than where these go on.
            told = (around < seen) | (own >= seen)
            edges = _edges(away[told], normals[around[told]], normals[own], KNOWN if own < seen else math.inf)
            if own < seen:
                edges = _agreed(edges, known)
                beyond, facing = away[~told], normals[around[~told]]
                known = [end for end in known if not _goes_on(end, beyond, facing, normals[own])]
            rest = [end for end in known if not any(_is_along(end, edge) for edge in edges)]
            for place, (offset, way) in enumerate(sorted([*edges, *rest], key=lambda end: end[0])[:MOST]):
                found.kept[own] &= own < seen or offset > 0.0
                found.offsets[own, place] = spacing * offset
                found.angles[own, place] = np.arctan2(way @ axes[own, 1], way @ axes[own, 0])
    return found


def _agreed(edges: list[End], own: list[End]) -> list[End]:
    """Those edges that a surfel which was seen may have: it is not past one, and ends nowhere else that way."""
    return [
        edge
        for edge in edges
        if edge[0] > 0.0 and all(abs(edge[0] - end[0]) < ON_PLANE for end in own if _is_along(end, edge))
    ]


def _goes_on(end: End, away: np.ndarray, facing: np.ndarray, normal: np.ndarray) -> bool:
    """Whether a surface was continued past an end, as where what hides the rest of it stands.

    Args:
        away: (K, 3) from the surfel's centre, in distances of neighbours, of what was guessed around it.
        facing: (K, 3) the normals of that.
        normal: (3,) its own.
    """
    offset, way = end
    along = away @ way
    aside = np.linalg.norm(np.cross(away, way), axis=1)
    flat = (facing @ normal > ACROSS) & (np.abs(away @ normal) < ON_PLANE)
    return bool((flat & (along > offset) & (along < NEAR) & (aside < ASIDE)).any())


def _is_along(end: End, other: End) -> bool:
    return float(end[1] @ other[1]) > np.cos(TURN)


def _edges(away: np.ndarray, facing: np.ndarray, normal: np.ndarray, known: float) -> list[End]:
    """How far the edges of a face are from a surfel of it, in its plane, and their (3,) outward directions.

    Args:
        away: (K, 3) of the surfels around it, itself among them, from its centre, in distances of neighbours.
        facing: (K, 3) their normals.
        normal: (3,) its own.
        known: an edge counts if its standard deviation is no more; with infinity even one that a single surfel tells.
    """
    turned, height = facing @ normal, away @ normal
    own = away[(turned > ACROSS) & (np.abs(height) < ON_PLANE)]
    others, close = np.abs(turned) < ACROSS, np.linalg.norm(away, axis=1) < NEAR
    edges = []
    while (left := np.flatnonzero(others & close)).size:
        nearest = left[np.linalg.norm(away[left], axis=1).argmin()]
        there = facing[nearest]
        alike = others & (facing @ there > ACROSS) & (np.abs((away - away[nearest]) @ there) < ON_PLANE)
        others = others & ~alike
        # All of them tell it: where depth is noisy single ones are turned by degrees.
        there = facing[alike].mean(axis=0)
        there = there / np.linalg.norm(there)
        plane = float((away[alike] @ there).mean())
        if _behind(own @ there - plane) and _behind(height[alike]):
            outward = there - (there @ normal) * normal
            length = float(np.linalg.norm(outward))
            edge = (plane / length, outward / length)
            if _deviation(away[alike], facing[alike], there, edge[0] * edge[1]) <= known * length:
                edges.append(edge)
    return edges


def _deviation(points: np.ndarray, facing: np.ndarray, normal: np.ndarray, place: np.ndarray) -> float:
    """Standard deviation of where the plane is at `place` (3,) that K surfels tell by their means.

    Args:
        points: (K, 3) their centres.
        facing: (K, 3) their normals.
        normal: (3,) of the plane.
    """
    count, middle = len(points), points.mean(axis=0)
    if count < 2:
        return math.inf
    heights = np.square((points - middle) @ normal).sum()
    turns = 0.5 * np.square(facing - normal).sum()
    lever = np.square(place - middle).sum() - np.square((place - middle) @ normal)
    return math.sqrt((heights + turns * max(lever, 0.0)) / (count * (count - 1)))


def _behind(heights: np.ndarray) -> bool:
    """Whether a face whose surfels are so far before another's plane lies behind it, but for what hangs over."""
    return float(heights.mean()) < 0.0 and float(heights.max()) < GOES_ON
