"""Scenes that are known exactly: their measures, and the flat surfaces that follow from them.

Blender builds its meshes from these, exact surfels and benchmarks their rectangles. All lie in the unit cube around the
origin, +z up; lengths are in scene units, colours are diffuse reflectance RGB.
"""

from rgspipe.scene.models.box import Box, Vector
from rgspipe.scene.models.cornell import CornellBox
from rgspipe.scene.models.corridor import Corridor
from rgspipe.scene.models.exact import exact_surfels
from rgspipe.scene.models.floor_plan import FloorPlan

__all__ = ["Box", "CornellBox", "Corridor", "FloorPlan", "Vector", "exact_surfels"]
