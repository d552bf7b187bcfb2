"""From gradients of what rays meet to those of the tensors that it is made of."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits


def radiance_gradient(hits: Hits, ray_view: Tensor, radiance: Tensor, colour_gradient: Tensor) -> Tensor:
    """(V, N, 3) gradient towards the radiance: the weights' transpose."""
    gradient = torch.zeros_like(radiance)
    ray, column = torch.nonzero(hits.indices >= 0, as_tuple=True)
    rows = ray_view.long()[ray] * radiance.shape[1] + hits.indices[ray, column].long()
    gradient.view(-1, 3).index_add_(0, rows, hits.weights[ray, column, None] * colour_gradient[ray])
    return gradient


def quaternion_gradient(quaternions: Tensor, to_rotation: Tensor) -> Tensor:
    """Gradient towards quaternions (N, 4) from that towards world-space rotation vectors (N, 3).

    A change dq of a unit quaternion q turns by ω = 2·Im(dq ⊗ q*).
    """
    w, x, y, z = torch.nn.functional.normalize(quaternions, dim=-1).unbind(-1)
    gx, gy, gz = (2.0 * to_rotation).unbind(-1)
    return torch.stack(
        [
            -(gx * x + gy * y + gz * z),
            gx * w + gy * z - gz * y,
            -gx * z + gy * w + gz * x,
            gx * y - gy * x + gz * w,
        ],
        dim=-1,
    )
