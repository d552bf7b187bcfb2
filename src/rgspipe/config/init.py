"""From depth maps to surfels."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.names import NormalSource
from rgspipe.options import Options, option


@dataclass(frozen=True)
class InitConfig(Options):
    """From depth maps to surfels."""

    surfels: int = option(10000, low=100, high=10000000)
    """how many surfels"""
    detail: float | None = option(None, low=0.01, high=100)
    """… times this; by default 2 for hotdog and room, which have much of it, else 1"""
    scale: float = option(0.6, low=0.05, high=10)
    """standard deviation of a surfel over the spacing of its neighbours"""
    normals: NormalSource = "auto"
    """fitted to the depth, or the views' normal pass"""
    clips: bool = True
    """straight edges for surfels at the border of a flat surface"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of points"""
