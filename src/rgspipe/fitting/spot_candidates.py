"""Coarse images of candidate spots: every candidate position, aimed everywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from rgspipe.fitting.blocks import BlockModel, block_model, patch_radiance
from rgspipe.fitting.coarse import CoarseImages
from rgspipe.fitting.dictionary import LightDictionary
from rgspipe.fitting.views import PreparedViews
from rgspipe.progress import track
from rgspipe.renderer.point_sets import fibonacci_directions
from rgspipe.renderer.spot import SpotShape, angle_from_axis, spot_profile
from rgspipe.renderer.spot_share import softened

#: Directions in which every candidate position is aimed.
AXES = 60

#: Candidates' rims are this much wider than they are [rad], as directions are so far apart.
SEARCH_SOFTNESS = 0.15

#: All views together have about this many blocks: there are many candidates.
BLOCKS_IN_ALL = 256

#: Candidates that send less than this share of the brightest one's light to the views are left out.
LEAST_SEEN = 0.01


def spot_candidates(
    views: PreparedViews, dictionary: LightDictionary, shapes: Sequence[SpotShape], *, interreflection: bool = True
) -> CoarseImages:
    """Candidate spots of given profiles at the dictionary's positions, with their coarse images.

    A spot's coarse image follows from that of a point light at its place: the share of light that the profile lets
    through is taken at the mean place of what each block sees, and of each patch.
    """
    side = max(6, round(math.sqrt(BLOCKS_IN_ALL / len(views.views))))
    model = block_model(views, side, interreflection=interreflection)
    direct, patches = _point_light_parts(views, dictionary, model)
    places = _places(views, model)
    directions = fibonacci_directions(AXES).to(places)
    images, positions, axes, kinds = [], [], [], []
    for index in track(range(len(dictionary)), "candidate spots", unit="place"):
        angle = angle_from_axis(directions[:, None], places - dictionary.positions[index].to(places))
        seen = torch.cat([_spots_seen(shape, angle, direct[index], patches[index], model) for shape in shapes])
        images.append(seen)
        positions.append(dictionary.positions[index].expand(len(seen), 3))
        axes.append(directions.repeat(len(shapes), 1))
        kinds.append(torch.arange(len(shapes)).repeat_interleave(AXES))
    joined = [torch.cat(parts) for parts in (images, positions, axes, kinds)]
    brightness = joined[0].sum(dim=(1, 2))
    kept = brightness > LEAST_SEEN * brightness.amax()
    seen, places, aims, which = (part[kept.to(part.device)] for part in joined)
    return CoarseImages(model.average, model.counts, seen, places, aims, tuple(shapes), which)


def _point_light_parts(views: PreparedViews, dictionary: LightDictionary, model: BlockModel) -> tuple[Tensor, Tensor]:
    """Of unit point lights the direct coarse images (C, B, 3), and the patches' direct radiosity (C, patches, 3)."""
    lights = dictionary.irradiance.T
    return model.direct(lights).permute(2, 0, 1), patch_radiance(views.frozen, lights).permute(2, 1, 0)


def _places(views: PreparedViews, model: BlockModel) -> Tensor:
    """(B + patches, 3) float32 mean place of what each block sees, and of each patch."""
    centers = views.frozen.surfels.centers.float()
    total = torch.from_numpy(model.weights @ centers.cpu().numpy()).to(centers)
    weight = torch.from_numpy(model.weights.sum(axis=1)).to(centers).clamp(min=1e-12)
    return torch.cat([total / weight.reshape(-1, 1), views.frozen.transport.average @ centers])


def _spots_seen(shape: SpotShape, angle: Tensor, direct: Tensor, patches: Tensor, model: BlockModel) -> Tensor:
    """(A, B, 3) coarse images of spots at one place, from the angles (A, B + patches) of what they light."""
    rim = (torch.tensor(x, dtype=angle.dtype) for x in (shape.cone_angle, shape.falloff))
    profile, cone, falloff = softened(shape.profile, *rim, SEARCH_SOFTNESS)
    share, _ = spot_profile(profile, angle, cone, falloff)
    count = len(model.counts)
    seen = share[:, :count, None] * direct
    for channel, bounced in enumerate(() if model.bounced is None else model.bounced):
        seen[:, :, channel] += (share[:, count:] * patches[:, channel]) @ bounced.T
    return seen
