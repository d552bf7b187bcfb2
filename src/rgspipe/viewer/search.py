"""Searches of the page: one at a time, on a copy of the scene, so that nobody's picture waits for them."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import replace

import torch

from rgspipe.errors import InputError
from rgspipe.fitting import FitResult, FitViews, LightSpec
from rgspipe.fitting.certainty.advice import ViewAdvice, suggest_views
from rgspipe.fitting.fit import Emitters
from rgspipe.fitting.model.capture import BaseImages, ImageCapture
from rgspipe.fitting.spec import as_spec
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, LightRig
from rgspipe.viewer.kept import Kept
from rgspipe.viewer.material import Photograph

#: What is looked for where nothing is said: lamps of any kind, and of any number up to that which searches try.
ANY = LightSpec("auto", count=None)

#: Sets of cameras whose views are kept.
KEPT_VIEWS = 3


class Finder:
    """Finds lamps in photographs.

    Args:
        frozen: the scene; what fits keep of it is not shared with those who look at it.
        exposure_free: whether every photograph but the first has an unknown exposure.
        base_scale_free: whether images with the lamps off are in photographs an unknown number of times.
        ambient: whether there may be light from all around through openings besides.
        looks_out: whether lamps that photographs show are looked for, where nobody said where they are.
    """

    def __init__(
        self,
        frozen: FrozenScene,
        exposure_free: bool = False,
        base_scale_free: bool = False,
        ambient: bool = False,
        looks_out: bool = True,
    ) -> None:
        self._looks_out = looks_out
        self._frozen, self._turn, self._ambient = replace(frozen), threading.Lock(), ambient
        self._exposure_free, self._base_scale_free = exposure_free, base_scale_free
        self._views: Kept[FitViews] = Kept(KEPT_VIEWS)

    @property
    def busy(self) -> bool:
        """Whether somebody's search is under way."""
        return self._turn.locked()

    def find(self, photographs: Sequence[Photograph], lights: str | LightSpec = ANY) -> FitResult:
        """The lamps of photographs, from these alone, and how many there are.

        Raises:
            InputError: there are no photographs.
        """
        with self._turn:
            views, capture = self._prepared(photographs, lights), self._capture(photographs)
            return views.fit(_images(photographs), capture=capture, emitters=self._emitters(photographs))

    def refit(self, photographs: Sequence[Photograph], start: LightRig) -> FitResult:
        """The lamps of photographs, as many and of those kinds that `start` has, from there downhill.

        Raises:
            InputError: there are no photographs, or no lamps to start from.
        """
        if not start:
            raise InputError("lamps", expected="at least one to start from", found="none", remedy="Add a lamp first.")
        with self._turn:
            return self._refit(photographs, start)

    def advice(
        self, photographs: Sequence[Photograph], start: LightRig, candidates: Sequence[Camera], wanted: float
    ) -> ViewAdvice:
        """Which of some cameras would tell most about the lamps, from a refit of those of now.

        Args:
            wanted: position error to reach, fraction of the scene's size.

        Raises:
            InputError: there are no photographs or no lamps, or nothing explains the photographs.
        """
        if not start:
            raise InputError("lamps", expected="at least one to ask about", found="none", remedy="Find them first.")
        with self._turn:
            result = self._refit(photographs, start)
            if not result.lights:
                raise InputError("lamps", expected="some light", found="none", remedy="Take a photograph with a lamp.")
            present = [taken.camera for taken in photographs]
            capture = self._capture(photographs)
            return suggest_views(self._frozen, result, present, candidates, wanted=wanted, capture=capture)

    def _emitters(self, photographs: Sequence[Photograph]) -> Emitters:
        """What is known of lamps that photographs show, for a search."""
        if all(taken.emitters is None for taken in photographs):
            return "auto" if self._looks_out else None
        return [torch.zeros(one.image.shape[:2]) if one.emitters is None else one.emitters for one in photographs]

    def _refit(self, photographs: Sequence[Photograph], start: LightRig) -> FitResult:
        views = self._prepared(photographs, ANY, lamps_out=True)
        return views.refit(_images(photographs), start, self._capture(photographs))

    def _capture(self, photographs: Sequence[Photograph]) -> ImageCapture:
        """How photographs were taken; of those without an image with the lamps off that is black."""
        base, clips = None, [taken.clip for taken in photographs]
        if any(taken.base is not None for taken in photographs):
            images = [torch.zeros_like(taken.image) if taken.base is None else taken.base for taken in photographs]
            base = BaseImages(images, self._base_scale_free)
        if min(clips) == math.inf:
            return ImageCapture(self._exposure_free, base=base)
        saturated = min(taken.saturated for taken in photographs)
        return ImageCapture(self._exposure_free, clips, saturated, base)

    def _prepared(
        self, photographs: Sequence[Photograph], lights: str | LightSpec, lamps_out: bool = False
    ) -> FitViews:
        """Views of the cameras; if `lamps_out` without the pixels that are known to show lamps."""
        if not photographs:
            remedy = "Take one with the button, or start the viewer with target=DIR."
            raise InputError("photographs", expected="at least one to find the lights of", found="none", remedy=remedy)
        cameras, lights = [taken.camera for taken in photographs], replace(as_spec(lights), ambient=self._ambient)
        owners = tuple((id(taken.mask), id(taken.emitters) if lamps_out else None) for taken in photographs)
        masks = None
        if any(taken.mask is not None or (lamps_out and taken.emitters is not None) for taken in photographs):
            masks = [_mask(taken, lamps_out) for taken in photographs]
        key = b"".join(camera.key for camera in cameras), repr(lights), owners
        return self._views.get(key, lambda: FitViews.prepare(self._frozen, cameras, lights=lights, masks=masks))


def _images(photographs: Sequence[Photograph]) -> list:
    return [taken.image for taken in photographs]


def _mask(taken: Photograph, lamps_out: bool) -> torch.Tensor:
    """(H, W) the scene's share of each pixel; 0 where it shows lamps themselves, if these are to be left out."""
    mask = torch.ones(taken.image.shape[:2]) if taken.mask is None else taken.mask
    if taken.emitters is None or not lamps_out:
        return mask
    return torch.where(torch.as_tensor(taken.emitters) >= 0.5, torch.zeros_like(mask), mask)
