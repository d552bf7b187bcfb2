"""Masks that leave out most of what is there are told."""

from __future__ import annotations

import torch

from rgspipe.evidence.masks import masked_out


def test_masks_that_leave_most_out_are_told() -> None:
    """Masks that are the wrong way round passed without a word; those of a thing before nothing leave nothing out."""
    kept = torch.ones(12, 12)
    kept[:3] = 0.0
    everywhere, thing = [torch.ones(12, 12, dtype=torch.bool)] * 2, [kept < 0.5] * 2
    assert masked_out(everywhere, [kept] * 2, "the scene") == ""
    line = masked_out(everywhere, [1.0 - kept] * 2, "the scene")
    assert line.startswith("masks or alpha leave out 75 % of the scene.")
    assert masked_out(thing, [1.0 - kept] * 2, "the scene") == ""
    assert masked_out([], [], "the scene") == ""
