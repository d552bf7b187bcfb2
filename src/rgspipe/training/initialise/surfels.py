"""The first surfels of a scene, from the depth of its training views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.names import NormalSource
from rgspipe.scene.surfels import Surfels
from rgspipe.training.initialise.back_projection import see_surfaces
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.fusion import fuse
from rgspipe.training.initialise.laying import Footprint, Laid, Laying
from rgspipe.training.initialise.resample import estimate_spacing
from rgspipe.training.initialise.through import LookedThrough

#: Pixels of depth that are used for each surfel that is wanted, about: memory goes with them. Of 800 in a room whose
#: depth has 1 % of noise, all leave normals 0.02° off, 400 0.03°, 200 0.05° and 100 0.07°; places are as good with 100.
SIGHTINGS = 200

#: So many surfels take the place of one that photographs look through, if these are more than so large a part of all:
#: below, layings of two seeds differ by more. A Cornell box has 0.1 to 0.4 %, furnished rooms have 3 to 8 %.
FINER, WORTH = 4, 0.01


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
    against local planes; surfels near the border of a flat surface get straight edges there. Where photographs look
    through surfels, smaller ones take their places. What no view sees gets no surfels.

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
    laying = Laying(cloud, seed, clips, footprint or Footprint(), LookedThrough(views) if views else None)
    return _finer_where_needed(laying, laying.of(cloud, count, estimate_spacing(cloud, count)))


def _finer_where_needed(laying: Laying, whole: Laid) -> Surfels:
    """As many surfels, smaller ones where photographs look through them and somewhat larger ones elsewhere."""
    count, share = len(whole.surfels), laying.too_coarse(whole).mean()
    if share < WORTH:
        return whole.surfels
    fewer = max(round(count / (1.0 + (FINER - 1) * share)), 1)
    even = laying.of(laying.cloud, fewer, whole.spacing * math.sqrt(count / fewer))
    coarse = laying.too_coarse(even)
    part, rest = laying.cloud[coarse[even.owner(laying.cloud)]], count - int((~coarse).sum())
    if not coarse.any() or len(part) < rest:
        return whole.surfels
    fine = laying.of(part, rest, even.spacing * math.sqrt(coarse.sum() / rest))
    return _both(even.surfels.selected(torch.from_numpy(np.flatnonzero(~coarse))), fine.surfels)


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


def _both(coarse: Surfels, fine: Surfels) -> Surfels:
    """The one and the other, with the rule of the first."""
    joined = {name: torch.cat([tensor, fine.tensors()[name]]) for name, tensor in coarse.tensors().items()}
    return replace(coarse, **joined)
