"""Triangles with what is known of their colour."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Paint:
    """Diffuse reflectance of F triangles: a colour at each corner, times a texture where there is one.

    Attributes:
        corners: (F, 3, 3) linear colours of the corners; NaN where nothing is known.
        uv: (F, 3, 2) places in the texture, from its lower left corner, which repeats.
        texture: (F,) number of the texture, −1 for none.
        textures: (H, W, 3) linear images, the upper row first.
    """

    corners: Numbers
    uv: Numbers
    texture: Indices
    textures: tuple[NDArray[np.float32], ...] = ()

    @cached_property
    def known(self) -> bool:
        """Whether there is a colour anywhere."""
        return bool(np.isfinite(self.corners).any())

    def at(self, faces: Indices, weights: Numbers) -> Numbers:
        """(M, 3) reflectance in [0, 1] at points (M, 3 barycentric weights) of triangles (M,); NaN if not known."""
        colour = np.einsum("mk,mkc->mc", weights, self.corners[faces])
        places = np.einsum("mk,mkd->md", weights, self.uv[faces])
        for number, image in enumerate(self.textures):
            mine = self.texture[faces] == number
            height, width = image.shape[:2]
            u, v = (places[mine] % 1.0).T
            column = np.minimum((u * width).astype(np.int64), width - 1)
            row = np.minimum(((1.0 - v) * height).astype(np.int64), height - 1)
            colour[mine] *= image[row, column]
        return np.clip(colour, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """F triangles between V points.

    Attributes:
        vertices: (V, 3) scene units.
        faces: (F, 3) int64, corners; which way round says nothing.
        paint: their colours.
        remarks: sentences on what a file said that is not in them.
    """

    vertices: Numbers
    faces: Indices
    paint: Paint
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.faces)

    @cached_property
    def _crosses(self) -> Numbers:
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        return np.cross(b - a, c - a)

    @property
    def areas(self) -> Numbers:
        """(F,) scene units²."""
        return 0.5 * np.linalg.norm(self._crosses, axis=1)

    @property
    def normals(self) -> Numbers:
        """(F, 3) unit normals, right-handed about the corners; 0 where there is no area."""
        lengths = np.linalg.norm(self._crosses, axis=1, keepdims=True)
        return np.divide(self._crosses, lengths, out=np.zeros_like(self._crosses), where=lengths > 0.0)

    @property
    def size(self) -> float:
        """Diagonal of the box around it."""
        corners = self.vertices[self.faces].reshape(-1, 3)
        return float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0)))

    def points(self, faces: Indices, weights: Numbers) -> Numbers:
        """(M, 3) points of triangles (M,) at barycentric weights (M, 3)."""
        return np.einsum("mk,mkd->md", weights, self.vertices[self.faces[faces]])

    def moved(self, matrix: Numbers) -> TriangleMesh:
        """Under an affine transform (4, 4)."""
        return replace(self, vertices=self.vertices @ matrix[:3, :3].T + matrix[:3, 3])
