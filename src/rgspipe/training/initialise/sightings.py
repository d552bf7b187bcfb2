"""What views saw: rays that met a surface, with the distance that was measured and what is made of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

#: Relative noise below which depth is taken as it is; rounding to half precision makes 2e-4.
EXACT = 3e-4
#: Cosine below which a grazing sighting is not taken to be any surer of the surface's offset.
GRAZING = 0.25


@dataclass(frozen=True)
class Sightings:
    """M pixels of all views, each a ray that met a surface; numpy float64.

    Attributes:
        origins: (M, 3) scene units.
        directions: (M, 3) unit vectors.
        measured: (M,) distances along the rays as the views have them, scene units.
        deviations: (M,) standard deviations of `measured`, scene units, at least EXACT of it.
        distances: (M,) present estimate of the distances.
        normals: (M, 3) present estimate of the normals, towards the cameras.
        given: (M,) whether the normal comes from a pass, and so is exact.
    """

    origins: np.ndarray
    directions: np.ndarray
    measured: np.ndarray
    deviations: np.ndarray
    distances: np.ndarray
    normals: np.ndarray
    given: np.ndarray

    def __len__(self) -> int:
        return len(self.measured)

    def __getitem__(self, index: np.ndarray) -> Sightings:
        return Sightings(**{item.name: getattr(self, item.name)[index] for item in fields(self)})

    @property
    def points(self) -> np.ndarray:
        """(M, 3) where the rays meet the surface as it is estimated."""
        return self.origins + self.directions * self.distances[:, None]

    @property
    def measured_points(self) -> np.ndarray:
        """(M, 3) where they met it as measured."""
        return self.origins + self.directions * self.measured[:, None]

    @property
    def noisy(self) -> bool:
        """Whether any view's depth is more than rounded."""
        return bool((self.deviations > 1.001 * EXACT * self.measured).any())

    def certainty(self) -> np.ndarray:
        """(M,) inverse variance of the offset of the measured point along its normal, 1/unit²."""
        cosine = np.maximum(-np.einsum("md,md->m", self.normals, self.directions), GRAZING)
        return 1.0 / (self.deviations * cosine) ** 2

    def moved(self, distances: np.ndarray, normals: np.ndarray) -> Sightings:
        """The same rays with new estimates; normals from a pass stay."""
        return replace(self, distances=distances, normals=np.where(self.given[:, None], self.normals, normals))


def joined(parts: Sequence[Sightings]) -> Sightings:
    """All sightings of several views."""
    return Sightings(
        **{item.name: np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(Sightings)}
    )
