"""A camera that is given, not drawn: plain values, for jobs and for Blender's process."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FixedView:
    """A camera at `origin` that looks at `focus`, `degrees` across; both (3,)."""

    origin: tuple[float, float, float]
    focus: tuple[float, float, float]
    degrees: float
