"""What is known of how fit targets were taken, and errors put into them for a study."""

from __future__ import annotations

from collections.abc import Sequence

import torch

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.views import View
from rgspipe.degradation.target_capture import captured
from rgspipe.errors import InputError
from rgspipe.fitting.fit import Emitters
from rgspipe.fitting.model.capture import SATURATED, ImageCapture, stored_in_eight_bits

#: Configuration keys that all this depends on.
KEYS = ("target_capture", "fit.exposure", "fit.clip")


def captured_views(views: Sequence[View], target: str, config: RgspipeConfig) -> tuple[list[View], ImageCapture]:
    """The views of a target with the errors of `target_capture`, and what a fit may know of how they were taken.

    Images that hold nothing but the levels of 8-bit sRGB are clipped at 1, others where their values pile up; or both
    where `fit.clip` says so.

    Raises:
        InputError: the paper's method is asked for unknown exposures.
    """
    free = config.fit.exposure == "free"
    taken, white = captured(views, target, config.target_capture)
    if config.fit.method == "paper_adam":
        if free:
            raise InputError(
                "fit.exposure",
                expected="known with fit=paper_adam",
                found="free",
                remedy="Use fit=search_lm for images of unknown exposure.",
            )
        return taken, ImageCapture()
    clip = white if white is not None else config.fit.clip
    return taken, ImageCapture(free, clip) if clip is not None else _found_capture(taken, free)


def known_emitters(views: Sequence[View], config: RgspipeConfig) -> Emitters:
    """What is known of lamps in sight: masks where a view of the target has one, or else what is configured."""
    if any(view.emitters is not None for view in views):
        return [torch.zeros_like(view.alpha) if view.emitters is None else view.emitters for view in views]
    return "auto" if config.fit.emitters == "auto" else None


def _found_capture(views: Sequence[View], free: bool) -> ImageCapture:
    """What the images themselves tell of where they are clipped."""
    limits = [view.saturated_from for view in views if view.saturated_from is not None]
    if all(stored_in_eight_bits(view.image, view.alpha) for view in views):
        return ImageCapture(free, 1.0, min(limits, default=SATURATED))
    return ImageCapture(free, limits[0]) if len(limits) == len(views) and len(set(limits)) == 1 else ImageCapture(free)
