"""Masks of targets that leave out most of the scene are told."""

from __future__ import annotations

from dataclasses import replace

import torch

from raycast import room_views
from rgspipe.stages.lights.masks import masked_out


def test_masks_that_leave_most_of_the_scene_out_are_told() -> None:
    """Masks that are the wrong way round passed without a word; those of a thing before nothing leave nothing out."""
    kept = torch.ones(12, 12)
    kept[:3] = 0.0
    views = [replace(view, alpha=kept) for view in room_views(2, 12)]
    everywhere = [torch.ones(144)] * 2
    assert masked_out("evening", views, everywhere) == ""
    inverted = [replace(view, alpha=1.0 - kept) for view in views]
    line = masked_out("evening", inverted, everywhere)
    assert line.startswith("target evening: masks or alpha leave out 75 % of what the scene shows")
    assert masked_out("evening", inverted, [(1.0 - kept).reshape(-1)] * 2) == ""
