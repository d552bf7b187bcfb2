"""Coarse images of candidates with an axis: every candidate position, aimed everywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.views import PreparedViews
from rgspipe.fitting.options import AimedOptions
from rgspipe.fitting.search.coarse import CoarseImages
from rgspipe.progress import progress_bar
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.blocks import BlockModel, block_model, patch_radiance
from rgspipe.renderer.point_sets import fibonacci_directions, neighbour_angle
from rgspipe.scene.lights import AxialLight
from rgspipe.scene.lights.angles import angle_from_axis


def aimed_candidates(
    views: PreparedViews,
    dictionary: LightDictionary,
    shapes: Sequence[AxialLight],
    options: AimedOptions | None = None,
    effects: Effects = ALL_EFFECTS,
) -> CoarseImages:
    """Candidate lights of given shapes at the dictionary's positions, with their coarse images.

    A light's coarse image follows from that of a point light at its place: the part of light that the profile lets
    through is taken at the mean place of what each block sees, and of each group of patches. Rims are wider by a third
    of what lies between neighbouring directions, so that a light that is aimed between them is like both.
    """
    options = options or AimedOptions()
    side = max(6, round(math.sqrt(options.blocks / len(views.views))))
    model = block_model(views, side, effects)
    lit = _lit_by_points(views, dictionary, model, options.blocks)
    directions, spacing = fibonacci_directions(options.axes).to(lit.direct), neighbour_angle(options.axes)
    images, positions, axes, kinds = [], [], [], []
    for index in progress_bar(range(len(dictionary)), "aimed candidates", unit="place"):
        away = (lit.places - dictionary.positions[index].to(lit.places)).to(directions)
        angle = angle_from_axis(directions[:, None], away)
        seen = torch.cat([_aimed_seen(shape, angle, lit, index, spacing / 3.0) for shape in shapes])
        images.append(seen)
        positions.append(dictionary.positions[index].expand(len(seen), 3))
        axes.append(directions.repeat(len(shapes), 1))
        kinds.append(torch.arange(len(shapes)).repeat_interleave(options.axes))
    joined = [torch.cat(parts) for parts in (images, positions, axes, kinds)]
    seen, origins, aims, which = joined
    return CoarseImages(model.average, model.counts, seen, origins, tuple(shapes), aims, which, spacing)


@dataclass(frozen=True)
class _LitByPoints:
    """What unit point lights at C places light, of which lights with an axis there let parts through.

    Attributes:
        places: (B + K, 3) float64 mean place of what each block sees, and of each group of patches.
        direct: (C, B, 3) direct coarse images.
        grouped: (C, K, 3) direct radiosity of the groups' patches, added up.
        bounced: (3, B, K) what blocks see of that after bounces; None without interreflection.
    """

    places: Tensor
    direct: Tensor
    grouped: Tensor
    bounced: Tensor | None


def _lit_by_points(views: PreparedViews, dictionary: LightDictionary, model: BlockModel, groups: int) -> _LitByPoints:
    lights = dictionary.irradiance.T
    direct = model.direct(lights).permute(2, 0, 1)
    patches = patch_radiance(views.frozen, lights).permute(2, 1, 0)
    members, places = _groups(views.frozen, groups)
    bounced = model.bounced
    if bounced is not None:
        # Within a group each patch counts as much as it does on the average over all lights.
        usual = patches.mean(dim=0).T.clamp(min=1e-12)
        bounced = ((bounced * usual[:, None]) @ members.T) / (usual @ members.T)[:, None]
    seen = torch.cat([_seen_places(views.frozen, model), places])
    return _LitByPoints(seen, direct, torch.einsum("kp,lpc->lkc", members, patches), bounced)


def _groups(frozen: FrozenScene, count: int) -> tuple[Tensor, Tensor]:
    """Compact groups of the frozen scene's patches: which they hold, 1 or 0, (K, patches), and mean places (K, 3)."""
    average, middle = frozen.transport.average, frozen.bvh.middle
    centers, normals = average @ _from_middle(frozen), average @ frozen.surfels.normals.float()
    labels = torch.from_numpy(cluster_patches(centers, normals, count, seed=0)).long()
    groups = torch.nn.functional.one_hot(labels).T.to(centers)
    return groups, (groups @ centers) / groups.sum(dim=1, keepdim=True) + middle


def _from_middle(frozen: FrozenScene) -> Tensor:
    """(N, 3) float32 centres of surfels from the scene's middle: from the origin, far scenes would lose digits."""
    return frozen.bvh.local(frozen.bvh.surfels.centers)


def _seen_places(frozen: FrozenScene, model: BlockModel) -> Tensor:
    """(B, 3) float64 mean place of what each block sees."""
    centers = _from_middle(frozen)
    total = torch.from_numpy(model.weights @ centers.cpu().numpy()).to(centers)
    weight = torch.from_numpy(model.weights.sum(axis=1)).to(centers).clamp(min=1e-12)
    return total / weight.reshape(-1, 1) + frozen.bvh.middle


def _aimed_seen(shape: AxialLight, angle: Tensor, lit: _LitByPoints, index: int, softness: float) -> Tensor:
    """(A, B, 3) coarse images of lights at place `index`, from the angles (A, B + K) of what they light."""
    relative, _ = shape.profile_at(angle, shape.numbers(angle), softness)
    count = lit.direct.shape[1]
    seen = relative[:, :count, None] * lit.direct[index]
    for channel, bounced in enumerate(() if lit.bounced is None else lit.bounced):
        seen[:, :, channel] += (relative[:, count:] * lit.grouped[index, :, channel]) @ bounced.T
    return seen
