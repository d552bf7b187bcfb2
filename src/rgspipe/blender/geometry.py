"""Questions about the surfaces of a scene: how near, what is in between, and where there is free space."""

from __future__ import annotations

from functools import cached_property

import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

#: Cells along the longest side of the grid that tells free space from solids.
GRID_CELLS = 32

#: Rays that measure how enclosed a place is.
ENCLOSURE_RAYS = 24

#: Cells that are asked how enclosed they are, about.
MAX_ENCLOSURE_CELLS = 2000

#: A place is inside a room if at least this share of directions ends on a surface.
ROOM_ENCLOSURE = 0.6

#: Closed rooms that fill at least this share of a scene's box are its interior.
CLOSED_SHARE = 0.1


class Geometry:
    """The triangles of a scene in a tree.

    Args:
        vertices: (V, 3) scene units.
        triangles: (T, 3) indices; a front face is counter-clockwise.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        self.lo, self.hi = vertices.min(axis=0), vertices.max(axis=0)
        self._tree = BVHTree.FromPolygons(vertices.tolist(), triangles.tolist(), all_triangles=True)

    def clearance(self, point: np.ndarray) -> float:
        """Distance from the nearest surface."""
        return float(self._tree.find_nearest(Vector(point))[3])

    def cast(self, origin: np.ndarray, direction: np.ndarray) -> tuple[float, bool]:
        """Distance to the first surface along a unit direction (inf for none), and whether its front was hit."""
        _, normal, _, distance = self._tree.ray_cast(Vector(origin), Vector(direction))
        if distance is None:
            return float("inf"), False
        return float(distance), float(np.dot(normal, direction)) < 0

    def blocked(self, start: np.ndarray, end: np.ndarray) -> bool:
        """Whether a surface lies between two points."""
        step = np.asarray(end) - np.asarray(start)
        length = float(np.linalg.norm(step))
        return length > 0 and self._tree.ray_cast(Vector(start), Vector(step / length), length)[0] is not None


def scene_geometry(scene: bpy.types.Scene) -> Geometry:
    """The triangles of all meshes in `scene`, in world coordinates, as they are rendered."""
    graph = bpy.context.evaluated_depsgraph_get()
    vertices, triangles, offset = [], [], 0
    for item in scene.objects:
        if item.type != "MESH":
            continue
        evaluated = item.evaluated_get(graph)
        points, corners = world_triangles(evaluated.to_mesh(), item.matrix_world)
        evaluated.to_mesh_clear()
        vertices.append(points)
        triangles.append(corners + offset)
        offset += len(points)
    return Geometry(np.concatenate(vertices), np.concatenate(triangles))


def world_triangles(mesh: bpy.types.Mesh, pose: Matrix) -> tuple[np.ndarray, np.ndarray]:
    """Points (V, 3) of a mesh in world coordinates, and the corners (T, 3) of its triangles, fronts counter-clockwise.

    Args:
        pose: of the mesh.
    """
    mesh.calc_loop_triangles()
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    matrix = np.array(pose)
    # A mirrored mesh shows its front faces where it did, although its corners go round the other way.
    turn = -1 if np.linalg.det(matrix[:3, :3]) < 0.0 else 1
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3], corners.reshape(-1, 3)[:, ::turn]


class FreeSpace:
    """Where cameras and lights can be: outside of solids, and not shut away from what surrounds them.

    A grid over the scene is flooded from outside; cells whose centres are joined by an unobstructed
    segment belong together. What the flood does not reach is a solid if its walls show it their back
    faces, and a closed room if they show it their front faces.

    Attributes:
        geometry: the surfaces.
        cell: edge length of a cell, scene units.
    """

    def __init__(self, geometry: Geometry) -> None:
        self.geometry = geometry
        self.cell = float((geometry.hi - geometry.lo).max()) / GRID_CELLS
        self._start = geometry.lo - 1.5 * self.cell
        counts = np.ceil((geometry.hi - geometry.lo) / self.cell).astype(int) + 3
        self._centers = self._start + self.cell * np.stack(
            np.meshgrid(*(np.arange(count) + 0.5 for count in counts), indexing="ij"), axis=-1
        )
        centers = self._centers.reshape(-1, 3)
        self._is_clear = [geometry.clearance(center) > self.cell for center in centers]
        labels = self._flood(counts)
        self._free = self._classify(labels)
        self._closed = self._free & (labels != 0)

    @cached_property
    def interior(self) -> np.ndarray:
        """(M, 3) centres of free cells inside a room: surfaces in most directions. Few or none for one object.

        Where there are closed rooms, what lies outside of them is no interior, however enclosed.
        """
        has_rooms = self._closed.sum() > CLOSED_SHARE * self._within_bounds.sum()
        candidates = self._centers[(self._closed if has_rooms else self._free) & self._within_bounds]
        candidates = candidates[:: 1 + len(candidates) // MAX_ENCLOSURE_CELLS]
        enclosed = [self._enclosure(center)[0] >= ROOM_ENCLOSURE for center in candidates]
        return candidates[np.array(enclosed, bool)]

    @cached_property
    def is_room(self) -> bool:
        """Whether the interior is a good part of the scene."""
        free = int((self._free & self._within_bounds).sum())
        share = len(self.interior) * (1 + free // MAX_ENCLOSURE_CELLS) / max(1, int(self._within_bounds.sum()))
        return share > 0.2

    @property
    def _within_bounds(self) -> np.ndarray:
        return ((self._centers > self.geometry.lo) & (self._centers < self.geometry.hi)).all(axis=-1)

    def contains(self, point: np.ndarray) -> bool:
        """Whether `point` is in free space: outside the grid, or joined to a free cell beside it."""
        index = np.floor((np.asarray(point) - self._start) / self.cell).astype(int)
        if (index < 0).any() or (index >= self._free.shape).any():
            return True
        lowest, highest = np.maximum(index - 1, 0), np.minimum(index + 2, self._free.shape)
        block = tuple(slice(low, high) for low, high in zip(lowest, highest, strict=True))
        near = self._centers[block][self._free[block]]
        near = near[np.argsort(((near - point) ** 2).sum(axis=1))]
        return any(not self.geometry.blocked(point, center) for center in near)

    def has_room_for(self, point: np.ndarray, clearance: float) -> bool:
        """Whether `point` is in free space, at least `clearance` from any surface."""
        return self.geometry.clearance(point) >= clearance and self.contains(point)

    def _flood(self, counts: np.ndarray) -> np.ndarray:
        """Component label of every cell; 0 is what surrounds the scene."""
        numbers = np.arange(int(np.prod(counts))).reshape(counts)
        joined = [self._open_neighbours(numbers, axis) for axis in range(3)]
        first, second = np.concatenate(joined, axis=1)
        graph = coo_matrix((np.ones(len(first), bool), (first, second)), shape=(numbers.size, numbers.size))
        _, labels = connected_components(graph, directed=False)
        order = np.concatenate([[labels[0]], np.setdiff1d(labels, labels[0])])
        rank = np.empty(len(order), int)
        rank[order] = np.arange(len(order))
        return rank[labels].reshape(counts)

    def _open_neighbours(self, numbers: np.ndarray, axis: int) -> np.ndarray:
        """(2, K) pairs of neighbours along `axis` with nothing in between."""
        low = np.take(numbers, range(numbers.shape[axis] - 1), axis=axis).ravel()
        high = np.take(numbers, range(1, numbers.shape[axis]), axis=axis).ravel()
        points = self._centers.reshape(-1, 3)
        # A cell's neighbours lie one edge length away: only near surfaces is there anything to ask.
        is_open = [
            self._is_clear[a] or not self.geometry.blocked(points[a], points[b])
            for a, b in zip(low.tolist(), high.tolist(), strict=True)
        ]
        return np.stack([low, high])[:, is_open]

    def _classify(self, labels: np.ndarray) -> np.ndarray:
        """Whether each cell is free: the surroundings, and closed rooms that see front faces."""
        free = labels == 0
        sizes = np.bincount(labels.ravel())
        for label in range(1, len(sizes)):
            cells = self._centers[labels == label]
            if sizes[label] < 8:
                continue
            probes = cells[:: max(1, len(cells) // 16)]
            free |= (labels == label) & (np.mean([self._enclosure(probe)[1] for probe in probes]) > 0.5)
        return free

    def _enclosure(self, point: np.ndarray) -> tuple[float, float]:
        """Share of directions that end on a surface, and on its front face."""
        hits = [self.geometry.cast(point, direction) for direction in sphere_points(ENCLOSURE_RAYS)]
        return float(np.mean([np.isfinite(hit[0]) for hit in hits])), float(np.mean([hit[1] for hit in hits]))


def sphere_points(count: int) -> np.ndarray:
    """(count, 3) unit vectors spread evenly (Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * index
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
