"""What a room's flat surfaces become where no camera looked: they go on until something ends them.

A surface that ends in sight shows what is beyond its edge: rays past the edge cross its plane. Where no ray does, and
the surface ends only as the frames of the cameras do, or behind something, it goes on; so do walls, floor and ceiling,
until they meet, or meet a thing's faces that nobody saw. The side from which the cameras looked is closed right behind
them if what was continued leads there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation, binary_opening, label

from rgspipe.completion.free_space import Grid, SeenSpace
from rgspipe.completion.hidden_faces import hidden_faces
from rgspipe.completion.planes import Plane
from rgspipe.completion.rasters import ACROSS, BARE, Continued, Raster, Sheet


def continued(
    planes: Sequence[Plane],
    centers: np.ndarray,
    grid: Grid,
    space: SeenSpace,
    spacing: float,
    *,
    is_room: bool,
    things: Continued,
) -> Continued:
    """What the planes of surfels become where nothing was seen, and the sides of the grid's box that they lead to.

    Args:
        planes: of surfels at `centers` (N, 3).
        grid: its box is all that there is.
        space: what cameras looked through.
        is_room: whether there may be walls at the box's sides.
        things: that are not flat, all around; planes and hidden faces end at them.
    """
    sheets = [Sheet.of(plane, centers, grid, space, spacing) for plane in planes]
    faces = hidden_faces(sheets, centers, things, grid, space, spacing)
    flat = [_whole(sheet) for sheet, own in zip(sheets, faces, strict=True) if len(own)]
    solids = Solids(Continued.joined([*faces, *flat, things]))
    inner = Continued.joined([*(_beyond(sheet, solids) for sheet in sheets), *faces])
    if not is_room:
        return inner
    known = np.concatenate([centers, inner.places])
    ends = [(axis, end) for axis in range(3) for end in (0, 1)]
    sides = [_side(axis, end, centers, known, solids, grid, space, spacing) for axis, end in ends]
    return Continued.joined([inner, *sides])


@dataclass(frozen=True)
class Solids:
    """What bounds things: faces that nobody saw, the surfaces behind whose edges these are, and all that is round."""

    bounds: Continued

    def through(self, raster: Raster) -> np.ndarray:
        """(A, B) bool: the places of a raster near bounds that are not along it, none of which ends before it."""
        across = np.abs(self.bounds.normals @ raster.normal) < ACROSS
        return raster.near(self.bounds.places[across], 2.0 * BARE)


def _whole(sheet: Sheet) -> Continued:
    """What was seen of a plane, and what it becomes if nothing divides it."""
    return Continued.joined([sheet.raster.chosen(sheet.supported), _beyond(sheet, Solids(Continued.joined([])))])


def _beyond(sheet: Sheet, solids: Solids) -> Continued:
    """The places of a plane within the box that its surfels border on more than what cameras saw through does."""
    # One place wide it is the blur of an edge.
    unknown = binary_opening(sheet.unknown | sheet.supported, np.ones((3, 3))) & ~sheet.supported

    def is_kept(rim: np.ndarray) -> bool:
        return bool(sheet.supported[rim].sum() > sheet.crossed[rim].sum())

    return sheet.raster.chosen(_parts(unknown, solids, sheet.raster, is_kept, outer=True))


def _side(
    axis: int,
    end: int,
    surfaces: np.ndarray,
    known: np.ndarray,
    solids: Solids,
    grid: Grid,
    space: SeenSpace,
    spacing: float,
) -> Continued:
    """The parts of a side of the box that no camera looked through, where surfaces lead to most of their rim."""
    normal = np.zeros(3)
    normal[axis] = 1.0 - 2.0 * end
    corner = grid.lower.numpy() if end == 0 else grid.upper.numpy()
    raster = Raster.on_plane(normal, float(normal @ corner), grid, spacing)
    unknown = raster.within(grid) & ~raster.crossed(space) & ~raster.near(surfaces, BARE)
    unknown = binary_opening(unknown, np.ones((3, 3)))
    near = raster.near(known, 2.0 * BARE)
    return raster.chosen(_parts(unknown, solids, raster, lambda rim: 2 * near[rim].sum() > rim.sum(), outer=False))


def _parts(
    unknown: np.ndarray, solids: Solids, raster: Raster, is_kept: Callable[[np.ndarray], bool], outer: bool
) -> np.ndarray:
    """The connected parts of `unknown` (A, B) places of a raster that are to be kept.

    Args:
        solids: whose bounds divide parts; the places near these go with the part beside them.
        is_kept: asked of the rim (A, B) of a part.
        outer: whether the rim is what lies around the part, or else what of the part lies at its edge.
    """
    cut = solids.through(raster)
    labels, count = label(unknown & ~cut)
    kept = np.zeros_like(unknown)
    for index in range(1, count + 1):
        part = labels == index
        # Surfaces reach past a thing's faces by the blur of their edges, and tell nothing of what is in the thing; and
        # where the faces divide a side, that rim leads nowhere.
        rim = binary_dilation(part) & ~part & ~cut if outer else part & ~_eroded(part | cut)
        if is_kept(rim):
            kept |= part
    return kept | binary_dilation(kept, iterations=2) & unknown & cut


def _eroded(part: np.ndarray) -> np.ndarray:
    return ~binary_dilation(~np.pad(part, 1), np.ones((3, 3)))[1:-1, 1:-1]
