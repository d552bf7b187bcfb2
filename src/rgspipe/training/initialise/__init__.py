"""Depth to surfels: normals, point cloud, even spacing, plane refinement, edges."""

from rgspipe.training.initialise.cloud import Cloud, NormalSource, cloud_from_views
from rgspipe.training.initialise.surfels import Footprint, initialise_surfels

__all__ = ["Cloud", "Footprint", "NormalSource", "cloud_from_views", "initialise_surfels"]
