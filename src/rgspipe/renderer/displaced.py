"""A frozen scene whose surfels stand a little elsewhere and cast other shadows; what they see of each other stays."""

from __future__ import annotations

from dataclasses import replace

from torch import Tensor

from rgspipe.renderer.frozen import FrozenScene


def displaced(frozen: FrozenScene, along: Tensor) -> FrozenScene:
    """The scene with each surfel moved by `along` (N, 3) scene units, a small part of a distance of surfels."""
    centers = (frozen.surfels.centers.double() if frozen.centers is None else frozen.centers) + along
    moved = replace(
        frozen, surfels=replace(frozen.surfels, centers=centers.to(frozen.surfels.centers)), centers=centers
    )
    # The cached property of that name: a hierarchy of its own would measure from another middle.
    moved.__dict__["bvh"] = frozen.bvh.displaced(centers)
    return moved
