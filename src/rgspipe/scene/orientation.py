"""Which side of a surfel is its front: files from elsewhere do not say, as others draw both sides."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import torch
from torch import Tensor

from rgspipe.scene.surfels import Surfels


def turned_over(surfels: Surfels, chosen: Tensor) -> Surfels:
    """The surfels with the fronts of those in `chosen` (N,) bool on the other side; footprints and edges stay."""
    w, x, y, z = surfels.rotations.unbind(-1)
    half_turn = torch.stack([-x, w, z, -y], dim=-1)  # about u: v and the normal change their signs
    return replace(
        surfels,
        rotations=torch.where(chosen[:, None], half_turn, surfels.rotations),
        clip_angles=torch.where(chosen[:, None], -surfels.clip_angles, surfels.clip_angles),
    )


def backs_towards(
    surfels: Surfels, viewpoints: Iterable[Tensor], seen: Callable[[Tensor], Tensor] | None = None
) -> Tensor:
    """(N,) bool, surfels whose backs are towards the viewpoints (V, 3), the nearer ones counting more.

    A surfel looks towards Σ_k s_k·(v_k − c)/|v_k − c|³, the field of charges s_k at the viewpoints.

    Args:
        seen: gives (N,) charges of a viewpoint (3,), such as the share of each surfel that is seen from there; without
            it all are 1, and what stands between a viewpoint and a surfel is not looked at.
    """
    field = torch.zeros_like(surfels.centers)
    for viewpoint in viewpoints:
        towards = viewpoint.to(surfels.centers) - surfels.centers
        pull = towards / towards.norm(dim=1, keepdim=True).clamp(min=1e-9).pow(3)
        field += pull if seen is None else seen(viewpoint)[:, None] * pull
    return (field * surfels.normals).sum(dim=1) < 0.0
