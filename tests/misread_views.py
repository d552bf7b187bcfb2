"""Views as they are read from files that were written by other conventions than they state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.evidence.readings import FLIP, Reading


def misread_view(view: View, meant: Reading, along_rays: bool = False) -> View:
    """A view whose files were written as `meant`, and are read as stated: `along_rays` says with which depth."""
    matrix = view.camera.camera_to_world.numpy()
    matrix = matrix @ FLIP if meant.opencv else matrix
    matrix = np.linalg.inv(matrix) if meant.inverse else matrix
    lengths = view.camera.rays()[2].reshape(view.depth.shape)
    depth = view.depth / meant.scale
    if meant.other_depth:
        depth = depth / lengths if along_rays else depth * lengths
    camera = replace(view.camera, camera_to_world=torch.from_numpy(matrix))
    return replace(view, camera=camera, depth=depth.float())
