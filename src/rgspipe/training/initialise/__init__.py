"""Depth to surfels: normals, one surface from all views, even spacing, plane refinement, edges."""

from rgspipe.training.initialise.back_projection import see_surfaces
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.surfels import Footprint, cloud_from_views, initialise_surfels, surfels_on

__all__ = ["Cloud", "Footprint", "cloud_from_views", "initialise_surfels", "see_surfaces", "surfels_on"]
