"""Where faces that were guessed end: at the other faces of their thing.

Surfels overlap, so one beside an edge hangs over it, by more than a distance of surfels where its face was laid down to
the edge. Those that cameras saw are cut there (`training.initialise.edges`); without that a lamp behind a thing has a
shadow that is too wide, and is taken to stand farther from it. Two faces that a thing turns outwards lie behind each
other's planes, so each is cut at the plane of the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.completion.rasters import ACROSS
from rgspipe.scene.surfels import NO_CLIP

#: Surfels of other faces are looked for so far from a surfel, and those of the two faces to tell how these lie to each
#: other, in distances of surfels.
NEAR, AROUND = 2.5, 4.0

#: Surfels on one plane are within so many distances of it.
ON_PLANE = 0.5

#: A face that goes on so many distances past another's plane does not end there.
GOES_ON = 2.0

#: Edges a surfel can have.
MOST = 2


@dataclass(frozen=True)
class Ends:
    """How U surfels end.

    Attributes:
        kept: (U,) bool: not those whose middle is past an end.
        offsets, angles: (U, 2) as of `Surfels`; NO_CLIP and 0 where there is no end.
    """

    kept: np.ndarray
    offsets: np.ndarray
    angles: np.ndarray


def ends(centers: np.ndarray, normals: np.ndarray, axes: np.ndarray, chosen: np.ndarray, spacing: float) -> Ends:
    """Of the surfels `chosen` (U,), indices, of those at `centers` (N, 3) with unit `normals` (N, 3).

    Args:
        axes: (U, 2, 3) in-plane axes u and v of the chosen ones.
        spacing: distance of neighbours.
    """
    found = Ends(np.ones(len(chosen), dtype=bool), np.full((len(chosen), MOST), NO_CLIP), np.zeros((len(chosen), MOST)))
    if not len(chosen):
        return found
    lists = cKDTree(centers).query_ball_point(centers[chosen], AROUND * spacing, return_sorted=True)
    for row, (own, near) in enumerate(zip(chosen, lists, strict=True)):
        around = np.asarray(near)
        away, facing = (centers[around] - centers[own]) / spacing, normals[around]
        edges = _edges(away, facing, normals[own])
        for place, (offset, outward) in enumerate(sorted(edges, key=lambda edge: edge[0])[:MOST]):
            found.kept[row] &= offset > 0.0
            found.offsets[row, place] = spacing * offset
            found.angles[row, place] = np.arctan2(outward @ axes[row, 1], outward @ axes[row, 0])
    return found


def _edges(away: np.ndarray, facing: np.ndarray, normal: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """How far the edges of a face are from a surfel of it, in its plane, and their (3,) outward directions.

    Args:
        away: (K, 3) of the surfels around it, itself among them, from its centre, in distances of neighbours.
        facing: (K, 3) their normals.
        normal: (3,) its own.
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
        plane = float((away[alike] @ there).mean())
        if _behind(own @ there - plane) and _behind(height[alike]):
            outward = there - (there @ normal) * normal
            length = float(np.linalg.norm(outward))
            edges.append((plane / length, outward / length))
    return edges


def _behind(heights: np.ndarray) -> bool:
    """Whether a face whose surfels are so far before another's plane lies behind it, but for what hangs over."""
    return float(heights.mean()) < 0.0 and float(heights.max()) < GOES_ON
