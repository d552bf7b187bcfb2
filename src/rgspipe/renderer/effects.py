"""Which parts of light transport are simulated; `effect_choice` decides which ones a scene calls for."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.renderer.zonal_harmonics import BandLimit
from rgspipe.scene.lights import Light, LightRig


@dataclass(frozen=True)
class Effects:
    """Which parts of light transport images and fits have."""

    shadows: bool = True
    """surfels stand in the light's way"""
    interreflection: bool = True
    """light bounces between surfels"""
    cones: bool = True
    """lights with an axis have their profile; else rigs are rendered as if they shone alike in all directions"""
    lobes: bool = True
    """glossy surfels have their specular lobes; else the scene is diffuse"""
    spots: BandLimit | None = None
    """how profiles are encoded in spherical harmonics; None for the exact ones"""

    def lights(self, rig: LightRig) -> LightRig:
        """The lights of a rig as these effects have them, each in one point."""
        return tuple(part for parts in self.parts(rig) for part in parts)

    def parts(self, rig: LightRig) -> list[tuple[Light, ...]]:
        """Of each light of a rig, as these effects have it, the points that shine together."""
        return [light.parts() for light in (rig if self.cones else [light.plain for light in rig])]


#: All of them, exactly.
ALL_EFFECTS = Effects()
