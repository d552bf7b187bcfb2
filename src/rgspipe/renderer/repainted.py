"""A frozen scene whose surfaces get another albedo: what they see of each other stays."""

from __future__ import annotations

from dataclasses import replace

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.transport import clustered_transport
from rgspipe.scene.surfels import Surfels


def repainted(frozen: FrozenScene, surfels: Surfels, *, patches: int = 1000, seed: int = 0) -> FrozenScene:
    """`FrozenScene.freeze` of matt surfels that are those of `frozen` but for their albedo, without casting a ray.

    Args:
        frozen: with its gather operator.
        surfels: N, where those of `frozen` are, without gloss.
        patches, seed: as of `freeze`.
    """
    centers = surfels.centers.double() if frozen.centers is None else frozen.centers
    exact = replace(surfels, centers=centers)
    transport = clustered_transport(frozen.gather, exact, frozen.areas, patches, seed=seed)
    return replace(frozen, surfels=surfels, transport=transport)
