"""Faces of things that nobody saw, behind edges that somebody did.

Where a flat surface ends in sight, rays past the edge cross its plane. If nothing is seen where another face would join
it there, this face exists all the same: a thing has another side. It begins at the edge, stands across the surface, and
goes back from it as long as no camera looked through where it would be, to whatever it meets there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.ndimage import binary_closing, binary_opening, label
from scipy.spatial import cKDTree

from rgspipe.completion.depth_views import Strip
from rgspipe.completion.free_space import Grid, SeenSpace
from rgspipe.completion.rasters import ACROSS, BARE, BEYOND, Continued, Sheet, are_near

#: Fewest places along an edge: what a side of the smallest plane has.
SHORTEST = 4

#: Where an edge is, in distances of surfels past the last one; and how far from it surfels tell that.
PAST, AROUND = 0.5, 2.0

#: So many distances of surfels behind an edge a face is not seen through: pixels are as wide as surfels.
GRAZED = 2.0

#: Rays that end within so many distances of surfels of a sheet's plane end on it.
ON_SURFACE = 0.25

#: Other faces end a face so many distances of surfels before they cross it.
CUT = 0.75

#: Planes touch where surfels of theirs are within so many distances of each other.
TOUCHING = 3.0

#: Half the sine of twice the angle within which two edges are taken for one direction: 3°.
SAME = 0.052

#: Part of the edge's surfels before the last ones, as single ones stand past it.
LAST = 0.9


@dataclass(frozen=True)
class _Edge:
    """Where a sheet ends in sight.

    Attributes:
        places: (E, 3) along it, one distance of neighbours apart.
        outward: (3,) unit, in the sheet: the normal of the face behind it.
        inward: (3,) unit, back from the sheet.
        seen: (E,) bool, the places that were seen to be one.
        sheet: that ends.
    """

    places: np.ndarray
    outward: np.ndarray
    inward: np.ndarray
    seen: np.ndarray
    sheet: Sheet


@dataclass(frozen=True)
class _WayBack:
    """What is met on the way back from an edge.

    Attributes:
        edge: of E places, from each of which it goes D steps.
        places: (E · D, 3).
        met: (E, D) bool, surfaces, or the end of the box.
        across: (E, D) bool, surfaces that stand across a face there, or the end of the box.
        seen_through: (E, D) bool, a camera saw something behind.
    """

    edge: _Edge
    places: np.ndarray
    met: np.ndarray
    across: np.ndarray
    seen_through: np.ndarray

    @classmethod
    def of(cls, edge: _Edge, known: np.ndarray, others: Continued, grid: Grid, space: SeenSpace) -> _WayBack:
        """Among places (K, 3) that have surfaces, first those of all surfels; on `others` is known where they face."""
        spacing = edge.sheet.raster.spacing
        steps = np.arange(0.5, np.linalg.norm((grid.upper - grid.lower).numpy()) / spacing) * spacing
        places = edge.places[:, None] + steps[:, None] * edge.inward
        inside = grid.contains(places.reshape(-1, 3)).reshape(places.shape[:2])
        # One step past the end of the box, which all ways meet.
        count = np.flatnonzero(inside.any(axis=0)).max(initial=0) + 2
        steps, places, outside = steps[:count], places[:, :count].reshape(-1, 3), ~inside[:, :count]

        def near(points: np.ndarray) -> np.ndarray:
            return are_near(points, places, BARE * spacing).reshape(outside.shape)

        met = outside | near(np.delete(known, edge.sheet.plane.members.numpy(), axis=0))
        across = outside | near(_across(others, edge.outward))
        behind = torch.from_numpy(places - BEYOND * spacing * edge.outward)
        # Cameras nearly in line with the face see past the edge in pixels that cover more than that.
        seen_through = space.holds(behind, 0.0, around=True).numpy().reshape(outside.shape)
        # Rays that graze the edge are taken to pass behind it.
        return cls(edge, places, met, across, seen_through & (steps > GRAZED * spacing))

    def face(self, others: Sequence[Continued] | None = None, open_ended: bool = False) -> Continued:
        """The places of the face behind the edge, up to what it meets, as `others` that are not along it.

        Without `others` it is as large as it may be: nothing parts it either.
        Where a camera looked through it before it met anything there is none, unless it may be `open_ended`: what was
        seen through a door is no inside. Nor is there one past what stands across and parts it from the edge as seen.
        """
        outward, met, parted = self.edge.outward, self.met, np.zeros_like(self.met)
        if others is not None:
            across = _across(Continued.joined([*others]), outward)
            near = are_near(across, self.places, CUT * self.edge.sheet.raster.spacing).reshape(met.shape)
            parted, met = _parted(near | self.across, self.edge.seen), met | near
        stops, steps = met | self.seen_through, met.shape[1]
        first = np.where(stops.any(axis=1), stops.argmax(axis=1), steps)
        is_met = open_ended | met[np.arange(len(met)), first.clip(max=steps - 1)]
        reached = (np.arange(steps) < first[:, None]) & is_met[:, None] & ~parted
        kept = binary_opening(reached, np.ones((3, 3))).reshape(-1)
        return Continued.facing(self.places[kept], outward)


def hidden_faces(
    sheets: Sequence[Sheet], centers: np.ndarray, things: Continued, grid: Grid, space: SeenSpace, spacing: float
) -> list[Continued]:
    """For each of the sheets the faces behind its edges.

    Args:
        sheets: of surfels at `centers` (N, 3), their places along the room.
        things: that are not flat, all around.
        grid: its box is all that there is.
        space: what cameras looked through.
    """
    ways = _ways(sheets, spacing)
    turned = [
        [Sheet.of(sheet.plane, centers, grid, space, spacing, along) for along in other]
        for sheet, other in zip(sheets, ways, strict=True)
    ]
    edges = [
        _longest(edge for one in (sheet, *more) for edge in _edges(one, space))
        for sheet, more in zip(sheets, turned, strict=True)
    ]
    surfaces = [Continued.facing(sheet.centers, sheet.raster.normal) for sheet in sheets]
    others = [Continued.joined([*_without(surfaces, i), things]) for i in range(len(sheets))]
    known, pairs = np.concatenate([centers, things.places]), zip(edges, others, strict=True)
    ways_back = [_WayBack.of(edge, known, other, grid, space) for own, other in pairs for edge in own]
    # First each as if there were no others, then up to these.
    whole = [way.face() for way in ways_back]
    faces = [way.face(_without(whole, i)) if len(whole[i]) else whole[i] for i, way in enumerate(ways_back)]
    # Where cameras look past a thing two of its faces end each other, of which either would be seen through.
    dropped = [i for i, one in enumerate(whole) if not len(one)]
    ending = [one if len(one) else way.face(open_ended=True) for way, one in zip(ways_back, whole, strict=True)]
    for _ in range(2):
        for i in dropped:
            faces[i] = ways_back[i].face(_without(ending, i))
        for i in dropped:
            ending[i] = ending[i] if len(faces[i]) else Continued.joined([])
    faces = _once(faces, spacing)
    rest = iter(faces)
    return [Continued.joined([next(rest) for _ in own]) for own in edges]


def _parted(across: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(E, D) bool: the places that hang together with those behind the `seen` (E,) part of an edge only through others.

    Edges go on where nothing is known of them, past the faces of their own thing and into other things.

    Args:
        across: (E, D) bool, what stands across a face there.
    """
    parts = label(~across)[0]
    start = seen[:, None] & (np.cumsum(across, axis=1) == 0)
    return ~across & ~np.isin(parts, parts[start])


def _across(surfaces: Continued, outward: np.ndarray) -> np.ndarray:
    """(K, 3) the places of surfaces that are not along a face with this normal (3,)."""
    return surfaces.places[np.abs(surfaces.normals @ outward) < ACROSS]


def _without(faces: Sequence[Continued], own: int) -> list[Continued]:
    return [*faces[:own], *faces[own + 1 :]]


def _once(faces: Sequence[Continued], spacing: float) -> list[Continued]:
    """The same without places that a larger face has, too: several edges of a thing lead to one face."""
    left, taken = list(faces), Continued.joined([])
    for index in sorted(range(len(faces)), key=lambda one: -len(faces[one])):
        if len(own := faces[index]):
            alike = taken.places[taken.normals @ own.normals[0] > ACROSS]
            left[index] = own.chosen(~are_near(alike, own.places, spacing))
            taken = Continued.joined([taken, left[index]])
    return left


def _ways(sheets: Sequence[Sheet], spacing: float) -> list[list[np.ndarray]]:
    """For each sheet how its edges may run besides along its rows and across: as the planes do that it touches."""
    trees, found = [cKDTree(sheet.centers) for sheet in sheets], []
    for sheet, tree in zip(sheets, trees, strict=True):
        known = [sheet.raster.axes[0]]
        for other, near in zip(sheets, trees, strict=True):
            along = np.cross(sheet.raster.normal, other.raster.normal)
            length = float(np.linalg.norm(along))
            if length**2 < 1.0 - ACROSS**2 or not tree.count_neighbors(near, TOUCHING * spacing):
                continue
            along = along / length
            # Edges that are at right angles are found with the same raster.
            turns = [abs(float(np.linalg.norm(np.cross(along, one)) * (along @ one))) for one in known]
            if min(turns) > SAME:
                known.append(along)
        found.append(known[1:])
    return found


def _longest(edges: Iterable[_Edge]) -> list[_Edge]:
    """Those that are not, for the most part, along a longer one that is turned a little."""
    kept: list[_Edge] = []
    for edge in sorted(edges, key=lambda one: -one.seen.sum()):
        alike = [other.places for other in kept if float(other.outward @ edge.outward) > ACROSS]
        reach = AROUND * edge.sheet.raster.spacing
        if not alike or are_near(np.concatenate(alike), edge.places, reach).mean() < 0.5:
            kept.append(edge)
    return kept


def _edges(sheet: Sheet, space: SeenSpace) -> Iterator[_Edge]:
    """All straight ones along the axes of its raster."""
    for axis in (0, 1):
        for sign in (1, -1):
            yield from _edges_towards(sheet, space, axis, sign)


def _edges_towards(sheet: Sheet, space: SeenSpace, axis: int, sign: int) -> Iterator[_Edge]:
    """Those past which places are crossed along an axis of the raster, with or against it."""

    def turned(values: np.ndarray) -> np.ndarray:
        return (values if axis == 1 else np.swapaxes(values, 0, 1))[:, ::sign]

    supported, crossed = turned(sheet.supported), turned(sheet.crossed & ~sheet.supported)
    goes_on = supported | turned(sheet.unknown)
    ends = supported & ~_next(supported, 1) & (_next(crossed, 1) | _next(crossed, 2))
    places = turned(sheet.raster.places.reshape(*sheet.raster.shape, 3))
    along, outward = sheet.raster.axes[1 - axis], sign * sheet.raster.axes[axis]
    # An edge that falls between two columns ends in both.
    while (pairs := ends[:, :-1].sum(axis=0) + ends[:, 1:].sum(axis=0)).size and pairs.max() >= SHORTEST:
        column = int(pairs.argmax())
        labels, count = label(binary_closing(ends[:, column : column + 2].any(axis=1), np.ones(3)))
        ends[:, column : column + 2] = False
        for run in (np.flatnonzero(labels == index) for index in range(1, count + 1)):
            past = _past(sheet, places[run, column], along, outward, space) if len(run) >= SHORTEST else None
            if past is not None:
                rows = _reach(run, goes_on[:, column])
                seen = np.isin(rows, run)
                yield _Edge(places[rows, column] + past * outward, outward, -sheet.raster.normal, seen, sheet)


def _next(values: np.ndarray, steps: int) -> np.ndarray:
    """`values` (R, C) that are so many columns further; False past the last."""
    return np.pad(values, ((0, 0), (0, steps)))[:, steps:]


def _past(sheet: Sheet, places: np.ndarray, along: np.ndarray, outward: np.ndarray, space: SeenSpace) -> float | None:
    """How far past places (E, 3) near an edge this is; None where no surfel is beside it.

    As photographs with depth show it, or else as the last of the surfels tell.
    """
    spacing, offset = sheet.raster.spacing, sheet.centers @ outward - float(places[0] @ outward)
    row, rows = sheet.centers @ along, places @ along
    low, high = rows.min() - spacing, rows.max() + spacing
    beside = (np.abs(offset) < AROUND * spacing) & (row > low) & (row < high)
    if not beside.any():
        return None
    last = float(np.quantile(offset[beside], LAST)) + PAST * spacing
    first, middle = float(places[0] @ along), places[0] + last * outward
    strip = Strip(middle, along, outward, sheet.raster.normal, (low - first, high - first), AROUND * spacing)
    further = space.depth_views.edge_in(strip, ON_SURFACE * spacing)
    return last + (further or 0.0)


def _reach(run: np.ndarray, goes_on: np.ndarray) -> np.ndarray:
    """The rows of a run, and those before and after it along which the surface goes on, seen or not."""
    labels, _ = label(goes_on | np.isin(np.arange(len(goes_on)), run))
    return np.flatnonzero(labels == labels[run[0]])
