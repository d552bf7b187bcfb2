"""The first surfels of a scene, from the depth of its training views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.names import NormalSource
from rgspipe.scene.surfels import NO_CLIP, Coverage, Surfels, quaternion_to_axes
from rgspipe.training.initialise.back_projection import see_surfaces
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.edges import find_edges
from rgspipe.training.initialise.extents import Extents, extents
from rgspipe.training.initialise.fusion import fuse
from rgspipe.training.initialise.planes import refit_planes
from rgspipe.training.initialise.resample import estimate_spacing, even_out, neighbour_spacing, thin_for
from rgspipe.training.initialise.through import LookedThrough

#: Pixels of depth that are used for each surfel that is wanted, about: memory goes with them. Of 800 in a room whose
#: depth has 1 % of noise, all leave normals 0.02° off, 400 0.03°, 200 0.05° and 100 0.07°; places are as good with 100.
SIGHTINGS = 200

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


def initialise_surfels(
    views: Sequence[View],
    count: int,
    *,
    seed: int,
    normals: NormalSource = "auto",
    clips: bool = True,
    footprint: Footprint | None = None,
    where: str | Path = "the training views",
) -> Surfels:
    """`count` surfels spread evenly over the surfaces that the views' depth shows.

    Depth is back-projected (p = o + d·r(x, y)), thinned, evened out in position and normal, and refined
    against local planes; surfels near the border of a flat surface get straight edges there. What no view sees
    gets no surfels.

    Args:
        views: training views; those without depth are passed over, at least one must have it.
        count: surfels.
        seed: the same views, count and seed give the same surfels.
        normals: "estimate" fits them to the depth, "pass" takes the views' normal passes, "auto" the pass
            where a view has one.
        clips: whether surfels get straight edges.
        footprint: scales, opacity and coverage to start from.
        where: the dataset's folder, for errors.

    Returns:
        float32 surfels on the CPU; normals face the side that was seen.

    Raises:
        InputError: no depth, bad depth, or too few points for `count`.
        ValueError: `count` is not positive.
    """
    if count < 1:
        raise ValueError(f"count must be at least 1, got {count}")
    cloud = cloud_from_views(views, count, normals=normals, where=where)
    if len(cloud) < count:
        raise InputError(
            where,
            expected=f"at least {count} depth pixels on surfaces, one for each surfel",
            found=f"{len(cloud)} in {sum(view.depth is not None for view in views)} views",
            remedy=f"Ask for at most {max(len(cloud) // 4, 1)} surfels (surfels=…), or give more views or a higher "
            "resolution.",
        )
    return surfels_on(cloud, count, seed=seed, clips=clips, footprint=footprint, views=views)


def surfels_on(
    cloud: Cloud,
    count: int,
    *,
    seed: int,
    clips: bool = True,
    footprint: Footprint | None = None,
    views: Sequence[View] = (),
) -> Surfels:
    """`count` surfels spread evenly over the surfaces of a cloud that has at least as many points.

    Args:
        cloud: dense points with normals towards the side that light falls on.
        seed, clips, footprint: as of `initialise_surfels`.
        views: photographs, those with depth of which tell where openings are.
    """
    footprint, spacing = footprint or Footprint(), estimate_spacing(cloud, count)
    thinned = thin_for(cloud, count, spacing)
    centers = refit_planes(even_out(thinned, count, spacing, np.random.default_rng(seed)), thinned, spacing)
    spacings, through = neighbour_spacing(centers, spacing), LookedThrough(views) if views else None
    reach = extents(centers, thinned, spacing)
    return _dress(centers, reach, spacings, cloud if clips else None, thinned, footprint, through)


def cloud_from_views(
    views: Sequence[View],
    count: int,
    *,
    normals: NormalSource = "auto",
    where: str | Path = "the training views",
) -> Cloud:
    """The surface points behind the pixels of all views that have depth, as measured if depth is exact, else fused.

    Args:
        count: surfels that the cloud is for; noise is averaged over about as far as they reach.

    Raises:
        InputError: as `see_surfaces`.
    """
    seen = see_surfaces(views, normals=normals, most=SIGHTINGS * count, where=where)
    cloud = Cloud(seen.points, seen.normals)
    if not seen.noisy:
        return cloud
    return fuse(seen, [view for view in views if view.depth is not None], estimate_spacing(cloud, count))


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
