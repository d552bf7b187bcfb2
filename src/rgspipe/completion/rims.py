"""Where surfels that were seen end: the straight edges that depth and photographs gave them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgspipe.scene.surfels import NO_CLIP, Surfels, quaternion_to_axes


@dataclass(frozen=True)
class Rims:
    """The straight edges of N surfels, up to two of each.

    Attributes:
        places: (N, 2, 3) of each edge the point that is nearest to the surfel's centre.
        outward: (N, 2, 3) unit, in the surfel's plane.
        known: (N, 2) bool, false where a surfel has no such edge.
    """

    places: np.ndarray
    outward: np.ndarray
    known: np.ndarray

    @classmethod
    def of(cls, surfels: Surfels) -> Rims:
        """Those of some surfels."""
        axes = quaternion_to_axes(surfels.rotations.double()).cpu().numpy()[:, :2]
        offsets, angles = (part.double().cpu().numpy() for part in (surfels.clip_offsets, surfels.clip_angles))
        known = offsets < NO_CLIP
        outward = np.cos(angles)[..., None] * axes[:, :1] + np.sin(angles)[..., None] * axes[:, 1:]
        centers = surfels.centers.double().cpu().numpy()[:, None]
        return cls(centers + np.where(known, offsets, 0.0)[..., None] * outward, outward, known)

    def ends(self, surfel: int) -> list[tuple[np.ndarray, np.ndarray]]:
        """Places (3,) and outward directions (3,) of those of one surfel."""
        return [(self.places[surfel, edge], self.outward[surfel, edge]) for edge in np.flatnonzero(self.known[surfel])]
