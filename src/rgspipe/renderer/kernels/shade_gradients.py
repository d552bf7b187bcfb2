"""From gradients of what rays meet to those of the tensors that it is made of."""

from __future__ import annotations

import torch
from torch import Tensor


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
