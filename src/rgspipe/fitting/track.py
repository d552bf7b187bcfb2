"""Moving lights: a sequence of frames of a fixed scene, each fit started from the last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import StrEnum

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment
from torch import Tensor

from rgspipe.fitting.capture import ImageCapture
from rgspipe.fitting.fit import FitViews, fit_lights
from rgspipe.fitting.parameters import Emitter
from rgspipe.fitting.problem import LightProblem
from rgspipe.fitting.result import FitResult, FitStatus
from rgspipe.fitting.schedule import soft
from rgspipe.fitting.search_lm import SearchOptions, fit_from
from rgspipe.fitting.spec import LightSpec
from rgspipe.fitting.starts import Rig
from rgspipe.progress import track
from rgspipe.scene import LightRig

#: Median residuals below this part of a pixel are as good as none.
SMALL_COST = 1e-3

#: The cost of a frame is judged by the median of so many frames before it.
REMEMBERED = 5


#: What a result tells of every light.
PER_LIGHT = ("lights", "covariance", "noise_covariance")


class FrameStatus(StrEnum):
    """How a frame's lights were found."""

    SEARCHED = "searched"
    TRACKED = "tracked"
    REDETECTED = "redetected"
    LOST = "lost"


@dataclass(frozen=True)
class TrackOptions:
    """How a sequence is followed.

    Attributes:
        lost: a frame whose cost rises beyond so many times that of the frames before is searched from nothing.
        iterations: most Levenberg-Marquardt steps of a tracked frame.
    """

    lost: float = 2.0
    iterations: int = 15


@dataclass(frozen=True)
class TrackedFrame:
    """One frame of a track.

    Attributes:
        result: the fit; its lights are in the order of the frames before.
        status: how they were found; LOST where neither the track nor the search explains the frame.
        cost: median of the pixels' residuals over their brightness, 1 without lights.
    """

    result: FitResult
    status: FrameStatus
    cost: float


def track_lights(
    views: FitViews,
    frames: Sequence[Sequence[Tensor]],
    spec: LightSpec | None = None,
    *,
    search: SearchOptions | None = None,
    options: TrackOptions | None = None,
    capture: ImageCapture | Sequence[ImageCapture] | None = None,
) -> list[TrackedFrame]:
    """Follow the lights of a sequence.

    The first frame is searched. A later one starts where the lights would be if they went on as between the two frames
    before, or where they were, whichever explains it better. It is searched from nothing if that ends at the bound,
    without light, or with a cost beyond `options.lost` times the median of the frames before; the better one is taken.

    Args:
        views: made by `prepare_fit` with a dictionary, for the same `spec`.
        frames: per frame one image (H, W, 3) a view.
        capture: of all frames, or one for each.
    """
    tracker = _Tracker(views, spec or LightSpec(), search or SearchOptions(), options or TrackOptions())
    same = capture is None or isinstance(capture, ImageCapture)
    captures = [capture or ImageCapture()] * len(frames) if same else capture
    found: list[TrackedFrame] = []
    for images, taken in track(list(zip(frames, captures, strict=True)), "following lights", unit="frame"):
        found.append(tracker.follow(found, images, taken))
    return found


@dataclass(frozen=True)
class _Tracker:
    views: FitViews
    spec: LightSpec
    search: SearchOptions
    options: TrackOptions

    def follow(self, before: Sequence[TrackedFrame], images: Sequence[Tensor], capture: ImageCapture) -> TrackedFrame:
        """The next frame."""
        stacked = self.views.prepared.stack_images(images)
        problem = LightProblem.create(self.views.prepared, stacked, self.views.effects, capture).sharpest()
        seen = [frame for frame in before if frame.result.lights]
        if not seen:
            result = self._searched(images, capture)
            return TrackedFrame(result, FrameStatus.SEARCHED, frame_cost(problem, result.lights))
        limit = self.options.lost * max(SMALL_COST, float(np.median([frame.cost for frame in seen[-REMEMBERED:]])))
        result = self._tracked(problem, before)
        cost = frame_cost(problem, result.lights)
        if cost <= limit and result.status != FitStatus.AT_BOUND:
            return TrackedFrame(in_order(result, seen[-1].result.lights), FrameStatus.TRACKED, cost)
        other = self._searched(images, capture)
        status, rival = FrameStatus.REDETECTED, frame_cost(problem, other.lights)
        if rival >= cost:
            status, rival, other = FrameStatus.TRACKED, cost, result
        if rival > limit:
            status = FrameStatus.LOST
        return TrackedFrame(in_order(other, seen[-1].result.lights), status, rival)

    def _searched(self, images: Sequence[Tensor], capture: ImageCapture) -> FitResult:
        return fit_lights(
            self.views.prepared.frozen, self.views, images, search=self.search, spec=self.spec, capture=capture
        )

    def _tracked(self, problem: LightProblem, before: Sequence[TrackedFrame]) -> FitResult:
        starts = self._starts(before)
        costs = [frame_cost(problem, tuple(emitter.light(torch.ones(3)) for emitter in rig)) for rig in starts]
        return fit_from(problem, starts[int(np.argmin(costs))], self.options.iterations)

    def _starts(self, before: Sequence[TrackedFrame]) -> list[Rig]:
        """The lights of the last frame that has any, and those after one more step like the last one."""
        last = self._emitters([frame for frame in before if frame.result.lights][-1].result.lights)
        # Where the lights were lost or found anew the step before says nothing of the next one.
        if len(before) < 2 or before[-1].status != FrameStatus.TRACKED:
            return [last]
        earlier = self._emitters(before[-2].result.lights)
        return [predicted(earlier, last), last] if len(earlier) == len(last) else [last]

    def _emitters(self, rig: LightRig) -> Rig:
        return soft(tuple(Emitter.of(light, self.spec.cone_free) for light in rig), 0.0)


def predicted(earlier: Rig, last: Rig) -> Rig:
    """The lights after one more step like that from `earlier` to `last`, of which counterparts have the same place."""
    moved = []
    for one, other in zip(earlier, last, strict=True):
        ahead = replace(other, position=2.0 * other.position - one.position)
        if one.is_spot and other.is_spot:
            axis = torch.nn.functional.normalize(2.0 * other.axis - one.axis, dim=0)
            ahead = replace(ahead, axis=axis)
        moved.append(ahead)
    return tuple(moved)


def frame_cost(problem: LightProblem, rig: LightRig) -> float:
    """Median over the pixels of the residual over the brightness, at the best intensities; 1 without lights."""
    if not rig or problem.black:
        return 1.0
    columns = [problem.evaluate(emitter) for emitter in soft(tuple(map(Emitter.of, rig)), 0.0)]
    weights = problem.relative_weights()
    intensity = problem.moments(columns, problem.unclipped(weights.square())).intensity
    # The weights' floor is part of the brightness, so a black image has a cost below 1 in dark pixels.
    return min(1.0, float((weights * problem.residual(columns, intensity)).abs().median()))


def in_order(result: FitResult, before: LightRig) -> FitResult:
    """The result with its lights, and all that is told of them, in the order of those that are nearest in `before`."""
    count = len(result.lights)
    if count < 2 or count != len(before):
        return result
    places = [torch.stack([light.position.double().cpu() for light in rig]).numpy() for rig in (before, result.lights)]
    apart = np.linalg.norm(places[0][:, None] - places[1][None], axis=-1)
    # Types stay apart: a spot is no point light's successor.
    kinds = np.array([[type(one) is not type(other) for other in result.lights] for one in before])
    order = linear_sum_assignment(apart + kinds * (1.0 + apart.max()) * count)[1]
    told = {item.name: getattr(result, item.name) for item in fields(result) if item.name in PER_LIGHT}
    return replace(result, **{name: tuple(values[k] for k in order) for name, values in told.items() if values})
