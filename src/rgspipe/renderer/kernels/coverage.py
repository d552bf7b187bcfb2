"""The one definition of coverage that camera, gather and shadow rays share (docs/reference/model/surfels.md).

Hits of a ray are ordered by depth. A layer starts at its front, the first hit that is in no layer yet, and
holds every hit within one thickness behind it:

    P_ℓ = Π_k (1 − α_k),   C_ℓ = smoothstep(low, high)(1 − P_ℓ),   T_{ℓ+1} = T_ℓ (1 − C_ℓ)
"""

from __future__ import annotations

import warp as wp

from rgspipe.scene.surfels import Coverage

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})


@wp.struct
class LayerRule:
    """A scene's `Coverage` as kernels read it."""

    thickness: float
    minimum_alpha: float
    low: float
    high: float


def layer_rule(coverage: Coverage) -> LayerRule:
    """The rule of a scene."""
    rule = LayerRule()
    rule.thickness, rule.minimum_alpha = coverage.layer_thickness, coverage.minimum_alpha
    rule.low, rule.high = coverage.low, coverage.high
    return rule


@wp.func
def smoothstep(y: float):
    """3y² − 2y³, 0 below 0 and 1 above 1."""
    x = wp.clamp(y, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


@wp.func
def smoothstep_slope(y: float):
    """Its derivative."""
    x = wp.clamp(y, 0.0, 1.0)
    return 6.0 * x * (1.0 - x)


@wp.func
def sharpened(clear: float, rule: LayerRule):
    """C of a layer with the raw transparency P = `clear`."""
    return smoothstep((1.0 - clear - rule.low) / (rule.high - rule.low))


@wp.func
def sharpened_slope(clear: float, rule: LayerRule):
    """dC/d(1 − P)."""
    return smoothstep_slope((1.0 - clear - rule.low) / (rule.high - rule.low)) / (rule.high - rule.low)
