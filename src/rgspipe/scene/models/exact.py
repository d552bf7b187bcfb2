"""Surfels with the exact geometry and reflectance of a model."""

from __future__ import annotations

from dataclasses import replace

import torch

from rgspipe.arguments import as_count
from rgspipe.errors import InputError
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.models.cornell import CornellBox
from rgspipe.scene.models.corridor import Corridor
from rgspipe.scene.rectangles import surfels_on
from rgspipe.scene.surfels import Surfels


def exact_surfels(model: CornellBox | Corridor, count: int) -> Surfels:
    """About `count` float32 surfels on the rectangles of a model; those on glossy boxes have their lobe.

    Raises:
        InputError: no model, or a count below 1.
    """
    count = as_count(count, "count", remedy="2000 are enough for a first look.")
    if not isinstance(model, CornellBox | Corridor):
        found, remedy = type(model).__name__, "Pass one: rg.CornellBox()."
        raise InputError("model", expected="a CornellBox or a Corridor", found=found, remedy=remedy)
    surfels = surfels_on(model.rectangles(), count)
    if isinstance(model, CornellBox) and model.gloss > 0.0:
        surfels = replace(surfels, gloss=_gloss(model, count))
    return surfels.to(torch.float32)


def _gloss(model: CornellBox, count: int) -> Gloss:
    rectangles = model.rectangles()
    on_boxes = torch.arange(len(rectangles)) >= len(model.walls())
    # Surfels are laid out alike whatever their albedo, so it can carry a mark.
    marked = replace(rectangles, albedo=on_boxes[:, None].double().expand(-1, 3))
    mark = surfels_on(marked, count).albedo
    return Gloss(model.gloss * mark, torch.where(mark[:, 0] > 0.5, model.shininess, 1.0).double())
