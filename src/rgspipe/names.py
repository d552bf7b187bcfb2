"""Names that people choose from, each list once: for the command line, which loads no torch, and for the library."""

from __future__ import annotations

from typing import Literal

#: Kinds of lights that a fit looks for, as light files have them; "auto": each may be of any.
LightType = Literal["point", "spot", "led", "sphere", "panel", "sun", "profile", "auto"]

#: What lights may hang on.
Mount = Literal["free", "surface", "ceiling"]

#: How a spot's intensity falls with the angle from its axis.
SpotProfile = Literal["smoothstep", "gaussian", "linear"]

#: Lights of a pool that Blender renders one at a time (profiles: measured luminaires), or the headlights of a car.
PoolKind = Literal["points", "spots", "spheres", "panels", "suns", "leds", "profiles", "drive"]

#: How light bounces.
Solver = Literal["patches", "gather", "monte_carlo"]

#: Where normals of depth maps come from.
NormalSource = Literal["auto", "estimate", "pass"]

#: What is known of the albedo before it is fitted.
AlbedoPrior = Literal["none", "dataset"]

#: How photographs of one place were exposed.
Exposure = Literal["same", "free", "free_colour"]

#: Formats of light files.
LightFormat = Literal["blend", "usda", "gltf", "mitsuba", "three", "ies", "json"]

#: Properties of surfels in a PLY file.
SurfelLayout = Literal["full", "viewer"]
