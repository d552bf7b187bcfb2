"""What scenes are built of: diffuse rectangles, boxes, balls and meshes, and lamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: The sides of the cube [-1, 1]³, as corners of it, and rows and columns of a ball that becomes triangles.
CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
ROWS, COLUMNS = 96, 192


@dataclass(frozen=True)
class Lamp:
    """A lamp that shines alike all around: a point that nobody sees, or a ball that images show.

    Attributes:
        place: (3,) [m].
        intensity: (3,) [W/sr].
        radius: [m]; 0 is a point.
    """

    place: np.ndarray
    intensity: np.ndarray
    radius: float = 0.0

    @property
    def radiance(self) -> np.ndarray:
        """(3,) of a ball [W/sr/m²]."""
        return self.intensity / (np.pi * self.radius**2)

    @property
    def matrix(self) -> np.ndarray:
        """(4, 4) that makes the unit ball this one."""
        matrix = np.diag([self.radius, self.radius, self.radius, 1.0])
        matrix[:3, 3] = self.place
        return matrix


@dataclass(frozen=True)
class Shape:
    """One diffuse surface.

    Attributes:
        kind: `rectangle` ([-1, 1]² in z = 0, seen from +z), `cube` ([-1, 1]³), `sphere` (of radius 1) or `mesh`.
        matrix: (4, 4) that places it in the scene; of a sphere its scale is the same along all axes.
        colour: (3,) reflectance.
        mesh: vertices (V, 3) and triangles (F, 3) of a mesh.
    """

    kind: str
    matrix: np.ndarray
    colour: np.ndarray
    mesh: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def middle(self) -> np.ndarray:
        return self.matrix[:3, 3]

    @property
    def radius(self) -> float:
        """Of a sphere."""
        return float(np.linalg.norm(self.matrix[:3, 0]))

    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (V, 3) in the scene and triangles (F, 3); a sphere becomes a fine mesh."""
        vertices, faces = _UNIT[self.kind]() if self.mesh is None else self.mesh
        return vertices @ self.matrix[:3, :3].T + self.matrix[:3, 3], faces


def _halved(quads: np.ndarray) -> np.ndarray:
    """(2 Q, 3) triangles of (Q, 4) corners."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _rectangle() -> tuple[np.ndarray, np.ndarray]:
    return np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), _halved(np.array([[0, 1, 2, 3]]))


def _cube() -> tuple[np.ndarray, np.ndarray]:
    return CORNERS, _halved(SIDES)


def _sphere() -> tuple[np.ndarray, np.ndarray]:
    down, around = np.meshgrid(
        np.linspace(0.0, np.pi, ROWS + 1), np.linspace(0.0, 2.0 * np.pi, COLUMNS + 1), indexing="ij"
    )
    places = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], axis=-1)
    at = np.arange(places.shape[0] * places.shape[1]).reshape(places.shape[:2])
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    faces = _halved(quads)
    # Quads at the poles have a side of no length, and one of their halves no area.
    corners = places.reshape(-1, 3)[faces]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    return places.reshape(-1, 3), faces[sides.min(axis=1) > 1e-6]


_UNIT = {"rectangle": _rectangle, "cube": _cube, "sphere": _sphere}
