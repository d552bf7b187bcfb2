"""Surfels and lights for other programs."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.names import LightFormat, SurfelLayout
from rgspipe.options import Options, option


@dataclass(frozen=True)
class ExportConfig(Options):
    """Surfels and lights for other programs."""

    light: str | None = None
    """light file: what export.lights writes; or colours of surfels show the scene under it, by default the albedo"""
    lights: tuple[LightFormat, ...] | None = None
    """write the lights of export.light, and no surfels: blend, usda, gltf, mitsuba, three, ies, json"""
    metres: float = option(1.0, low=1e-9, high=1e9)
    """of lights: how long a unit of the scene's own file is (a .blend's, or that of your images' poses)"""
    layout: SurfelLayout = "full"
    """all of a surfel, for this program and viewers that read properties by name; or just those of 3DGS, in order"""
