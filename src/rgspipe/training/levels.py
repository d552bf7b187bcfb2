"""What the errors of a view's image are measured against.

Errors of a model are as large as what it shows. A photograph that is dark where the model shows light, as of a lamp
that stands inside of a cupboard, would count for a hundred others if its errors were measured against its own peak.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

#: Share of a view's values up to its peak: fewer are highlights and lamps.
SHARE = 0.99


def peak(image: Tensor) -> Tensor:
    """Scalar radiance that few values of an image exceed, above 0."""
    return torch.quantile(image.float(), SHARE).clamp(min=1e-12)


def level(image: Tensor, expected: Tensor) -> Tensor:
    """Scalar radiance that errors of an image are measured against: its peak, or that of what a model shows."""
    return torch.maximum(peak(image), peak(expected))


def levels(images: Sequence[Tensor], expected: Sequence[Tensor]) -> list[Tensor]:
    """The level of each of V images, where the model's albedo is not known yet: its images all may be too bright.

    Args:
        expected: V images of the model, which are right up to a factor that is the same in most of them.
    """
    pairs = [(peak(image), peak(shown)) for image, shown in zip(images, expected, strict=True)]
    factor = torch.stack([image / shown for image, shown in pairs]).median() if pairs else 1.0
    return [torch.maximum(image, factor * shown) for image, shown in pairs]
