"""The angle between an axis and where light goes, with derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

#: Keep the angle's derivative finite on the axis, where the angle is wrong by the square root of the first
#: (1e-9 rad), and for a point at the light itself, which has no angle.
_ON_AXIS, _AT_LIGHT = 1e-18, 1e-30


def angle_from_axis(axis: Tensor, towards: Tensor) -> Tensor:
    """(…,) angle in [0, π] between `axis` (…, 3) and vectors `towards` (…, 3), neither of unit length necessarily.

    By the two-argument arctangent, which is exact near 0 and π where the arccosine loses half of its digits.
    """
    a, v = axis.unbind(-1), towards.unbind(-1)
    return torch.atan2(_across(_cross(a, v), v), _dot(a, v))


def angle_slopes(axis: Tensor, towards: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """`angle_from_axis` (…,) and its derivatives (…, 3) towards `towards` and towards `axis`.

    With w = a × v, S = √(|w|² + δ|v|² + ε) and C = a·v the angle is atan2(S, C), so that

        ∂θ/∂v = (C (w × a + δv)/S − S a) / (S² + C²),     ∂θ/∂a = (C (v × w)/S − S v) / (S² + C²).
    """
    # One component after the other, each in one piece of memory, takes a third of the time of rows of three.
    a, v = axis.unbind(-1), towards.movedim(-1, 0).contiguous().unbind(0)
    w = _cross(a, v)
    across, along = _across(w, v), _dot(a, v)
    inverse = 1.0 / (across.square() + along.square())
    outwards, inwards = along / across * inverse, across * inverse
    pairs = zip(_cross(w, a), _cross(v, w), v, a, strict=True)
    slopes = [
        (outwards * (wa + _ON_AXIS * vi) - inwards * ai, outwards * vw - inwards * vi) for wa, vw, vi, ai in pairs
    ]
    by_towards, by_axis = (torch.stack(parts, dim=-1) for parts in zip(*slopes, strict=True))
    return torch.atan2(across, along), by_towards, by_axis


def _cross(a: Sequence[Tensor], b: Sequence[Tensor]) -> list[Tensor]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Sequence[Tensor], b: Sequence[Tensor]) -> Tensor:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _across(cross: Sequence[Tensor], towards: Sequence[Tensor]) -> Tensor:
    """S, never zero."""
    return (_dot(cross, cross) + _ON_AXIS * _dot(towards, towards) + _AT_LIGHT).sqrt()
