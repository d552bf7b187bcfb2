"""A frozen scene whose surfaces get another albedo: what they see of each other stays."""

from __future__ import annotations

from dataclasses import replace

from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.transport import build_patch_transport
from rgspipe.scene.surfels import Surfels


def repainted(frozen: FrozenScene, surfels: Surfels, *, patches: int = 1000, seed: int = 0) -> FrozenScene:
    """`FrozenScene.freeze` of matt surfels that are those of `frozen` but for their albedo, without casting a ray.

    Args:
        frozen: with its gather operator.
        surfels: N, where those of `frozen` are, without gloss.
        patches, seed: as of `freeze`.
    """
    centers = surfels.centers.double() if frozen.centers is None else frozen.centers
    count = patches if frozen.gather.entries else 1
    labels = cluster_patches(centers, surfels.normals, count, seed=seed)
    transport = build_patch_transport(frozen.gather, labels, frozen.areas, surfels.albedo)
    return replace(frozen, surfels=surfels, transport=transport)
