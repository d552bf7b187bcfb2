"""Coarse images of candidates at infinity: their light from all directions."""

from __future__ import annotations

import torch

from rgspipe.fitting.search.coarse import CoarseImages
from rgspipe.progress import progress_bar
from rgspipe.renderer.ambient import lets_light_in
from rgspipe.renderer.dictionary import BATCH
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.images.blocks import BlockModel
from rgspipe.renderer.point_sets import fibonacci_directions, neighbour_angle
from rgspipe.scene.lights import Light


def distant_candidates(model: BlockModel, shape: Light, count: int) -> CoarseImages:
    """Candidates like `shape`, which is at infinity, from `count` directions, with their coarse images.

    Into a closed scene no light comes: what a surfel gets there leaks past an edge.
    """
    frozen, shadows = model.frozen, model.effects.shadows
    axes = fibonacci_directions(count).double()
    places = torch.cat([-axes, axes.new_zeros(count, 1)], dim=1)
    lit = axes.new_zeros(count, len(frozen.surfels), dtype=torch.float32)
    if not shadows or lets_light_in(frozen):
        batches = progress_bar(places.split(BATCH), "distant candidates", unit="batch")
        lit = torch.cat([unit_irradiance(frozen.bvh, block, shadows)[0] for block in batches])
    images = model.seen(lit.T).permute(2, 0, 1).contiguous()
    standing = frozen.surroundings.middle - frozen.size * axes
    return CoarseImages(model.average, model.counts, images, standing, (shape,), axes, None, neighbour_angle(count))
