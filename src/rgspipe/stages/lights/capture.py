"""What is known of how fit targets were taken, and errors put into them for a study."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import torch

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.exif_exposure import EXPOSE_ALIKE, check_exposures
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_target import captured
from rgspipe.errors import InputError
from rgspipe.evidence.masks import masked_out
from rgspipe.fitting.fit import Emitters, FitViews
from rgspipe.fitting.model.capture import SATURATED, BaseImages, ImageCapture, stored_in_eight_bits

#: Configuration keys that all this depends on.
KEYS = ("target_capture", "fit.exposure", "fit.clip", "fit.base_scale")


def captured_views(views: Sequence[View], target: str, config: RgspipeConfig) -> tuple[list[View], ImageCapture]:
    """The views of a target with the errors of `target_capture`, and what a fit may know of how they were taken.

    Images that hold nothing but the levels of 8-bit sRGB are clipped at 1, others where their values pile up; or both
    where `fit.clip` says so.

    Raises:
        InputError: the paper's method is asked for unknown exposures or given a base, only some of the views have a
            base, one is stored in 8 bits beside images that are not, or files state other exposures than are known.
    """
    _check_exposures(views, f"target {target}", config)
    free, base = config.fit.exposure == "free", _base(views, target, config)
    taken, white = captured(views, target, config.target_capture)
    if config.fit.method == "paper_adam":
        if free or base is not None:
            raise InputError(
                "fit.exposure" if free else "fit.base",
                expected="known with fit=paper_adam" if free else "none with fit=paper_adam",
                found="free" if free else "images with the lamps off",
                remedy="Use fit=search_lm for such images.",
            )
        return taken, ImageCapture()
    clip = white if white is not None else config.fit.clip
    capture = ImageCapture(free, clip) if clip is not None else found_capture(taken, free)
    return taken, capture if base is None else replace(capture, base=base)


def _check_exposures(views: Sequence[View], where: str, config: RgspipeConfig) -> None:
    """Refuse what files state against exposures that are taken for alike: of views, and of each with its base.

    Raises:
        InputError: says which are not, and what to set.
    """
    if config.fit.exposure != "free":
        remedy = "Set fit.exposure=free, or photograph all with one exposure."
        check_exposures([(view.name, view.exposure) for view in views], where, remedy)
    off = [(f"{view.name} with the lamps off", view.base_exposure) for view in views]
    if config.fit.base_scale == "free":
        check_exposures(off, where, EXPOSE_ALIKE)
        return
    remedy = "Photograph with one exposure with the lamps on and off, or set fit.base_scale=free."
    for view, without in zip(views, off, strict=True):
        check_exposures([(view.name, view.exposure), without], where, remedy)


def _base(views: Sequence[View], target: str, config: RgspipeConfig) -> BaseImages | None:
    """What the views show with the lamps off; None where they say nothing of it.

    Raises:
        InputError: see `captured_views`.
    """
    images = [view.base for view in views if view.base is not None]
    if not images:
        return None
    if len(images) < len(views):
        expected, remedy = "an image with the lamps off for every view that is used", "Add base_path to all frames."
        raise InputError(f"target {target}", expected=expected, found=f"{len(images)} of {len(views)}", remedy=remedy)
    eight = [stored_in_eight_bits(view.base, view.alpha) for view in views]
    if any(eight) and not all(stored_in_eight_bits(view.image, view.alpha) for view in views):
        raise InputError(
            f"target {target}",
            expected="images with the lamps off that hold radiance, as the target's do",
            found="levels of 8 bits",
            remedy="Store both the same way: of a value that is clipped in one alone no difference is known.",
        )
    if config.target_capture != type(config.target_capture)():
        expected, remedy = "targets without images with the lamps off", "Leave target_capture away."
        raise InputError("target_capture", expected=expected, found=f"some of {target}", remedy=remedy)
    return BaseImages(images, config.fit.base_scale == "free")


def tell_masks(where: str, views: Sequence[View], prepared: FitViews) -> None:
    """Say so if masks leave out most of what the scene shows in these views."""
    shown = [view.coverage.cpu() >= 0.5 for view in prepared.prepared.views]
    if line := masked_out(shown, [view.alpha.reshape(-1) for view in views], "what the scene shows in its images"):
        print(f"{where}: {line}")


def known_emitters(views: Sequence[View], config: RgspipeConfig) -> Emitters:
    """What is known of lamps in sight: masks where a view of the target has one, or else what is configured."""
    if any(view.emitters is not None for view in views):
        return [torch.zeros_like(view.alpha) if view.emitters is None else view.emitters for view in views]
    return "auto" if config.fit.emitters == "auto" else None


def found_capture(views: Sequence[View], free: bool = False) -> ImageCapture:
    """What the images themselves tell of where they are clipped."""
    limits = [view.saturated_from for view in views]
    known = [limit for limit in limits if limit is not None]
    if all(stored_in_eight_bits(view.image, view.alpha) for view in views):
        return ImageCapture(free, 1.0, min(known, default=SATURATED))
    # The others say nothing, and are as they were.
    return ImageCapture(free, [math.inf if limit is None else limit for limit in limits] if known else None)
