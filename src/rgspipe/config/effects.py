"""Which parts of light transport are computed."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.names import Solver
from rgspipe.options import Options, option


@dataclass(frozen=True)
class EffectsConfig(Options):
    """Which parts of light transport are computed."""

    shadows: bool = True
    """surfels block light"""
    interreflection: bool = True
    """light bounces between surfels"""
    at_pixels: bool = True
    """direct light where pixels look, in a fit's last steps: sharper than at surfels' centres, and dearer"""
    solver: Solver = "patches"
    """how light bounces: averaged over patches, through the full gather operator, or by the paper's random rays"""
    bounces: int | None = option(None, low=0, high=1000)
    """how many; by default all, and 4 for monte_carlo"""
    samples: int = option(64, low=1, high=65536)
    """random rays of a surfel and bounce, for monte_carlo"""
    auto: bool = True
    """leave out, of these, what cannot change an image by more than `tolerance`"""
    tolerance: float = option(0.001, low=0, high=1)
    """with auto: largest change, fraction of the brightest direct radiance"""
