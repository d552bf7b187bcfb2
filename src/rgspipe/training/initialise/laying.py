"""How surfels are laid on a cloud of points, and which of them are too coarse for it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import cKDTree

from rgspipe.scene.surfels import NO_CLIP, Coverage, Surfels, quaternion_to_axes
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.edges import EdgeOptions, find_edges
from rgspipe.training.initialise.extents import Extents, extents
from rgspipe.training.initialise.finer import looked_through
from rgspipe.training.initialise.planes import refit_planes
from rgspipe.training.initialise.resample import even_out, features, neighbour_spacing, thin_for
from rgspipe.training.initialise.through import LookedThrough

#: Most deviations of what a surfel stands for that its own may be: half as many again as those of an even cell are. Of
#: the pixels of views that were left out 4.49, 4.32 and 4.32 % are off with 2.64, 3.3 and 4.5 in a furnished room.
EXTENT = 3.3


@dataclass(frozen=True)
class Footprint:
    """What every surfel starts as; lengths in units of the spacing to its neighbours.

    Attributes:
        scale: standard deviation of a whole surfel.
        clipped_growth: how much larger one is that ends at an edge, so that coverage stays full up to the edge.
        opacity: in [0, 1].
        albedo: in [0, 1]; training finds the true one.
        coverage_low, coverage_high: thresholds of Coverage that go with these scales.
        clip_softness: width of the ramp at an edge.
        minimum_alpha: see Coverage.
    """

    scale: float = 0.6
    clipped_growth: float = 1.4
    opacity: float = 0.95
    albedo: float = 0.5
    coverage_low: float = 0.5
    coverage_high: float = 0.9
    clip_softness: float = 0.12
    minimum_alpha: float = 0.01

    @property
    def seen(self) -> tuple[float, float]:
        """How far a surfel is seen where another like it lies, in spacings: one that is whole, and one at an edge.

        Two of opacity α cover 1 − (1 − α)², which is seen from `coverage_low` on.
        """
        least = 1.0 - math.sqrt(1.0 - self.coverage_low)
        whole = self.scale * math.sqrt(2.0 * math.log(max(self.opacity / least, 1.0)))
        return whole, whole * self.clipped_growth


@dataclass(frozen=True)
class Laid:
    """Surfels on a cloud.

    Attributes:
        surfels: the N that were laid.
        centers: where they stand.
        thinned: the points that they stand for.
        spacing: between them, scene units.
    """

    surfels: Surfels
    centers: Cloud
    thinned: Cloud
    spacing: float

    def owner(self, cloud: Cloud) -> np.ndarray:
        """(M,) the surfel that each point belongs to."""
        own = cKDTree(features(self.centers, self.spacing))
        return own.query(features(cloud, self.spacing), workers=-1)[1]


@dataclass(frozen=True)
class Laying:
    """How surfels are laid on parts of a cloud; as of `surfels_on`."""

    cloud: Cloud
    seed: int
    clips: bool
    footprint: Footprint
    through: LookedThrough | None

    def of(self, part: Cloud, count: int, spacing: float) -> Laid:
        """So many, evenly, on the points of a part."""
        thinned = thin_for(part, count, spacing)
        even = even_out(thinned, count, spacing, np.random.default_rng(self.seed))
        centers = refit_planes(even, thinned, spacing)
        cloud = self.cloud if self.clips else None
        apart, reach = neighbour_spacing(centers, spacing), extents(centers, thinned, spacing)
        surfels = _dress(centers, reach, apart, cloud, thinned, self.footprint, self.through)
        return Laid(surfels, centers, thinned, spacing)

    def too_coarse(self, laid: Laid) -> np.ndarray:
        """(N,) which of the surfels photographs look through."""
        if self.through is None or not self.clips:
            return np.zeros(len(laid.surfels), dtype=bool)
        reach, beyond = self.footprint.seen[0] / self.footprint.scale, EdgeOptions().plane_tolerance * laid.spacing
        return looked_through(laid.surfels, reach, laid.thinned, self.through, laid.spacing, beyond)


def _dress(
    centers: Cloud,
    reach: Extents,
    spacing: np.ndarray,
    cloud: Cloud | None,
    thinned: Cloud,
    footprint: Footprint,
    through: LookedThrough | None,
) -> Surfels:
    """Surfels at `centers` with scales from their spacing (N,), no wider than what they stand for, and with edges if
    the whole cloud is given.
    """
    count, median = len(centers), float(np.median(spacing))
    offsets, angles = np.full((count, 2), NO_CLIP), np.zeros((count, 2))
    if cloud is not None:
        axes = quaternion_to_axes(reach.rotations).numpy()
        offsets, angles = find_edges(centers, axes, cloud, thinned, spacing, footprint.seen, through)
    growth = np.where(offsets[:, 0] < NO_CLIP, footprint.clipped_growth, 1.0)
    scale = torch.from_numpy(footprint.scale * growth * spacing).float()
    scales = torch.minimum(scale[:, None], torch.from_numpy(EXTENT * growth[:, None] * reach.spread).float())
    coverage = Coverage(
        low=footprint.coverage_low,
        high=footprint.coverage_high,
        layer_thickness=float(scale.median()),
        clip_softness=footprint.clip_softness * median,
        minimum_alpha=footprint.minimum_alpha,
    )
    return Surfels(
        centers=torch.from_numpy(centers.points).float(),
        rotations=reach.rotations.float(),
        scales=scales,
        opacities=torch.full((count,), footprint.opacity),
        albedo=torch.full((count, 3), footprint.albedo),
        clip_offsets=torch.from_numpy(offsets).float(),
        clip_angles=torch.from_numpy(angles).float(),
        coverage=coverage,
    )
