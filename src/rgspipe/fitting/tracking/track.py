"""Moving lights: a sequence of frames of a fixed scene, followed both ways from the frame that is easiest to search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from rgspipe.arguments import as_one_of, as_several
from rgspipe.errors import InputError
from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.fit import FitViews
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import TrackOptions
from rgspipe.fitting.result import dark_result
from rgspipe.fitting.search.schedule import soft
from rgspipe.fitting.solvers import Search
from rgspipe.fitting.tracking.frame import FrameStatus, TrackedFrame, frame_cost, in_order
from rgspipe.fitting.tracking.frame_fit import Followed, follow, observed
from rgspipe.fitting.tracking.motion import Motion
from rgspipe.fitting.tracking.twins import split_lights
from rgspipe.machine.sums import total
from rgspipe.progress import progress_bar
from rgspipe.scene import LightRig
from rgspipe.scene.arrays import ArrayLike, as_list, as_tensor


def track_lights(
    views: FitViews,
    frames: Sequence[Sequence[ArrayLike] | ArrayLike],
    *,
    options: TrackOptions | None = None,
    search: Search | None = None,
    capture: ImageCapture | Sequence[ImageCapture] | None = None,
) -> list[TrackedFrame]:
    """Follow the lights of a sequence.

    Frames are searched from nothing in the order of their energy, Σ y² (much where light falls directly on what is
    seen), until one has a sure answer. From there the lights are followed to the end of the sequence and back to its
    beginning: each frame is fitted with what the frames before tell of positions, axes, their rates and intensities
    (`motion`), which counts as far as its own images leave them open. A frame that is lost is fitted from the same
    start without that, then searched, as long as `options.searches` allows for; one that stays lost is tried once more
    from its other neighbour.

    Args:
        views: of all frames.
        frames: per frame one image (H, W, 3) a view.
        options: how.
        search: how frames are searched from nothing.
        capture: of all frames, or one for each.

    Raises:
        InputError: light from all around, or images with the lamps off of unknown strength, are among the unknowns; or
            there are not as many captures as frames.
    """
    as_one_of(views, FitViews, "views", "FitViews.prepare makes them of a scene and its cameras.")
    search = as_one_of(search or Search(), Search, "search", "Pass Search(…).")
    options = as_one_of(options or TrackOptions(), TrackOptions, "options", "Pass TrackOptions(…).")
    taken = [as_list(images, axes=3) for images in frames]
    given = as_several(capture or ImageCapture(), ImageCapture, "capture", "Pass one, or one for each frame.")
    captures = given * len(taken) if capture is None or isinstance(capture, ImageCapture) else given
    if len(captures) != len(taken):
        expected, found = f"one, or one for each of {len(taken)} frames", f"{len(captures)} of them"
        raise InputError("capture", expected=expected, found=found, remedy="Pass as many as frames.")
    if views.lights.ambient or any(one.base is not None and one.base.scale_free for one in captures):
        raise InputError(
            "lights.ambient" if views.lights.ambient else "base",
            expected="nothing unknown but lights in a sequence",
            found="light that is there anyway, of unknown strength",
            remedy="Give images with the lamps off, of known strength, or fit each frame by itself.",
        )
    return _Tracker(views, search, options, list(zip(taken, captures, strict=True))).run()


@dataclass(frozen=True)
class _Known:
    """A frame, where the lights go from there, f, and whether the track began at a sure frame."""

    frame: TrackedFrame
    motion: Motion | None
    inflation: float
    anchored: bool


class _Tracker:
    """One sequence and what has been found of it, frame by frame."""

    def __init__(
        self,
        views: FitViews,
        search: Search,
        options: TrackOptions,
        taken: Sequence[tuple[Sequence[ArrayLike], ImageCapture]],
    ) -> None:
        self.views, self.search, self.options, self.taken = views, search, options, taken
        self.found: dict[int, _Known] = {}
        self.left = options.searches

    def run(self) -> list[TrackedFrame]:
        """All frames."""
        start = self._anchor()
        if start is not None:
            count = len(self.taken)
            ways = [*range(start + 1, count), *range(start - 1, -1, -1)]
            for index in progress_bar(ways, "following lights", unit="frame"):
                self._follow(index, 1 if index > start else -1)
            for way in (-1, 1):
                for index in range(count)[::way]:
                    self._retrace(index, way)
        dark = TrackedFrame(dark_result(0.0), FrameStatus.LOST, 1.0)
        return [self.found[index].frame if index in self.found else dark for index in range(len(self.taken))]

    def _anchor(self) -> int | None:
        """The frame to follow the lights from: the first sure one, or else the one that is explained best."""
        tried: dict[int, _Known] = {}
        for index in search_order([frame_energy(images) for images, _ in self.taken], self.options.searches):
            self.left -= 1
            known = self._searched(index, FrameStatus.SEARCHED, None)
            if known is not None:
                tried[index] = known
            if known is not None and self._sure(known):
                break
        if not tried:
            return None
        best = min(tried, key=lambda index: (not self._sure(tried[index]), tried[index].frame.cost))
        self.found[best] = self._doubted(tried[best], anchored=self._sure(tried[best]))
        return best

    def _follow(self, index: int, way: int) -> None:
        """Fit the next frame in the direction `way`, or search it if it is lost."""
        before = self.found[index - way]
        problem = self._problem(index)
        if problem.black:
            dark = TrackedFrame(dark_result(0.0), FrameStatus.LOST, 1.0)
            self.found[index] = replace(before, frame=dark, motion=before.motion.predicted())
            return
        limit = self._limit(index, way)
        known = self._followed(problem, before, way)
        if self._is_lost(known, limit):
            known = self._followed(problem, replace(before, motion=before.motion.released()), way)
        if self._is_lost(known, limit):
            known = self._found_again(index, before, known, limit)
        self.found[index] = known

    def _found_again(self, index: int, before: _Known, followed: _Known, limit: float) -> _Known:
        """A lost frame searched from nothing if that is still allowed; what was predicted of it if that fails, too."""
        if self.left > 0:
            self.left -= 1
            other = self._searched(index, FrameStatus.REDETECTED, before)
            if other is not None and other.frame.cost < followed.frame.cost:
                lost = other.frame.cost > limit
                status = FrameStatus.LOST if lost else other.frame.status
                return self._doubted(replace(other, frame=replace(other.frame, status=status)), self._sure(other))
        lost = replace(followed.frame, status=FrameStatus.LOST)
        return replace(before, frame=lost, motion=before.motion.predicted())

    def _retrace(self, index: int, way: int) -> None:
        """Try a lost frame from its neighbour at `index - way`."""
        neighbour = self.found.get(index - way)
        if neighbour is None or neighbour.frame.status == FrameStatus.LOST:
            return
        problem = self._problem(index)
        if self.found[index].frame.status != FrameStatus.LOST or problem.black:
            return
        known = self._followed(problem, neighbour, way)
        if not self._is_lost(known, self._limit(index, way)):
            self.found[index] = known

    def _followed(self, problem: LightProblem, before: _Known, way: int) -> _Known:
        made = follow(
            problem, before.motion.predicted(), before.inflation, self.search.iterations, self.search.certainty
        )
        status = FrameStatus.TRACKED if way > 0 else FrameStatus.TRACED_BACK
        return self._doubted(self._known(problem, made, status), before.anchored)

    def _sure(self, known: _Known) -> bool:
        return known.frame.sure(self.search.certainty.doubtful, self.options.faint)

    @staticmethod
    def _is_lost(known: _Known, limit: float) -> bool:
        return known.frame.cost > limit or known.frame.result.status == FitStatus.AT_BOUND

    def _searched(self, index: int, status: FrameStatus, before: _Known | None) -> _Known | None:
        """A frame searched from nothing, in the order of the lights before; None where no light is found."""
        images, capture = self.taken[index]
        result = self.views.fit(images, solver=self.search, capture=capture, emitters=None)
        problem = self._problem(index)
        result = split_lights(problem, result, self.views.blocks, self.search)
        if not result.lights:
            return None
        if before is not None:
            result = in_order(result, tuple(light for light in before.frame.result.lights))
        made = observed(problem, self._emitters(result.lights), self.options, self.search.certainty)
        return self._known(problem, replace(made, result=result), status)

    def _known(self, problem: LightProblem, made: Followed, status: FrameStatus) -> _Known:
        errors = tuple(made.motion.position_errors())
        frame = TrackedFrame(made.result, status, frame_cost(problem, made.result.lights), errors)
        return _Known(frame, made.motion, made.inflation, True)

    def _doubted(self, known: _Known, anchored: bool) -> _Known:
        """The frame as part of a track that had a sure frame, or had none."""
        frame = known.frame
        doubtful = not anchored or max(frame.position_errors, default=1.0) > self.search.certainty.doubtful
        if doubtful and frame.status != FrameStatus.LOST:
            frame = replace(frame, status=FrameStatus.UNCERTAIN)
        return replace(known, frame=frame, anchored=anchored)

    def _problem(self, index: int) -> LightProblem:
        images, capture = self.taken[index]
        stacked = self.views.prepared.stack_images(images)
        return self.views.problem(stacked, capture, self.search.loss).sharpest()

    def _limit(self, index: int, way: int) -> float:
        """The cost from which on a frame is lost, by the frames next to it on the side that it is followed from."""
        near = [self.found.get(index - way * back) for back in range(1, self.options.remembered + 1)]
        costs = [known.frame.cost for known in near if known is not None and known.frame.status != FrameStatus.LOST]
        return self.options.lost * max(self.options.explained, float(np.median(costs))) if costs else 1.0

    def _emitters(self, rig: LightRig) -> tuple[Emitter, ...]:
        return soft(tuple(Emitter.of(light, self.views.lights.shape_free) for light in rig), 0.0)


def frame_energy(images: Sequence[ArrayLike]) -> float:
    """Σ y² over the images (H, W, 3) of a frame.

    Raises:
        InputError: one has another shape.
    """
    shown = (as_tensor(image, "images", ("H", "W", 3)) for image in images)
    return sum(float(total(torch.nan_to_num(image).double().square())) for image in shown)


def search_order(energies: Sequence[float], searches: int) -> list[int]:
    """Up to `searches` frames, those with most energy first, but none next to one that was searched in vain.

    The sequence is divided into 2 · `searches` equal stretches; no two of the frames are closer than one of these.
    """
    apart, chosen = max(1, len(energies) // max(1, 2 * searches)), []
    for index in sorted(range(len(energies)), key=lambda k: -energies[k]):
        if len(chosen) == searches or not energies[index] > 0.0:
            break
        if all(abs(index - other) >= apart for other in chosen):
            chosen.append(index)
    return chosen
