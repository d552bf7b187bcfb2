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
from rgspipe.fitting.result import REASONS, FitResult, FitStatus
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


#: Of two answers to a frame the one from a search with a single answer wins, unless it costs so many times the other.
AS_GOOD = 1.1

#: Results with one answer, which a track may go on from.
ONE_ANSWER = (FitStatus.CONVERGED, FitStatus.UNDETERMINED, FitStatus.MAX_ITERATIONS)

#: A light with less than this part of the strongest one's intensity explains nothing: it may be anywhere.
FAINT = 0.02

#: What a result tells of every light.
PER_LIGHT = ("lights", "covariance", "noise_covariance")


class FrameStatus(StrEnum):
    """How a frame's lights were found."""

    SEARCHED = "searched"
    TRACKED = "tracked"
    REDETECTED = "redetected"
    TRACED_BACK = "traced_back"
    LOST = "lost"


@dataclass(frozen=True)
class TrackOptions:
    """How a sequence is followed.

    Attributes:
        lost: a frame whose cost rises beyond so many times that of the frames before is searched from nothing.
        iterations: most Levenberg-Marquardt steps of a tracked frame.
        back: whether frames without a sure answer are followed back from the frames after them.
    """

    lost: float = 2.0
    iterations: int = 15
    back: bool = True


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

    @property
    def sure(self) -> bool:
        """Whether there is one answer, with all of its lights; what follows an unsure frame is unsure, too."""
        strengths = [float(light.intensity.mean()) for light in self.result.lights]
        faint = bool(strengths) and min(strengths) < FAINT * max(strengths)
        return self.status != FrameStatus.LOST and self.result.status in ONE_ANSWER and not faint


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
    before, or where they were, whichever explains it better. It is searched from nothing, too, if that ends at the
    bound, without light, or with a cost beyond `options.lost` times the median of the frames before, or if the frame
    before has no sure answer; the better one is taken. With `options.back` frames without a sure answer, such as those
    of a light that is still around the corner, are at last followed back from the frames after them.

    Args:
        views: made by `prepare_fit` with a dictionary, for the same `spec`.
        frames: per frame one image (H, W, 3) a view.
        capture: of all frames, or one for each.
    """
    tracker = _Tracker(views, spec or LightSpec(), search or SearchOptions(), options or TrackOptions())
    same = capture is None or isinstance(capture, ImageCapture)
    captures = [capture or ImageCapture()] * len(frames) if same else capture
    taken = list(zip(frames, captures, strict=True))
    found: list[TrackedFrame] = []
    for images, how in track(taken, "following lights", unit="frame"):
        found.append(tracker.follow(found, images, how))
    return tracker.trace_back(found, taken) if tracker.options.back else found


@dataclass(frozen=True)
class _Tracker:
    views: FitViews
    spec: LightSpec
    search: SearchOptions
    options: TrackOptions

    def follow(self, before: Sequence[TrackedFrame], images: Sequence[Tensor], capture: ImageCapture) -> TrackedFrame:
        """The next frame."""
        problem = self._problem(images, capture)
        seen = [frame for frame in before if frame.result.lights]
        if not seen:
            result = self._searched(images, capture)
            return TrackedFrame(result, FrameStatus.SEARCHED, frame_cost(problem, result.lights))
        last, limit = seen[-1], self._limit(seen[-REMEMBERED:])
        # Where the lights were lost or found anew the step before says nothing of the next one.
        earlier = before[-2] if len(before) > 1 and before[-1].status == FrameStatus.TRACKED else None
        result = self._tracked(problem, last, earlier)
        cost = frame_cost(problem, result.lights)
        if last.sure and cost <= limit and result.status != FitStatus.AT_BOUND:
            return TrackedFrame(in_order(result, last.result.lights), FrameStatus.TRACKED, cost)
        other = self._searched(images, capture)
        status, rival = FrameStatus.REDETECTED, frame_cost(problem, other.lights)
        bonus = AS_GOOD if not last.sure and other.status in ONE_ANSWER else 1.0
        if rival >= bonus * cost:
            status, rival, other = FrameStatus.TRACKED, cost, result if last.sure else _ambiguous(result)
        if rival > limit:
            status = FrameStatus.LOST
        return TrackedFrame(in_order(other, last.result.lights), status, rival)

    def trace_back(
        self, found: Sequence[TrackedFrame], taken: Sequence[tuple[Sequence[Tensor], ImageCapture]]
    ) -> list[TrackedFrame]:
        """Frames without a sure answer followed back from those after them, as far as that explains them."""
        kept = list(found)
        for index in range(len(kept) - 2, -1, -1):
            after = kept[index + 1 : index + 1 + REMEMBERED]
            if kept[index].sure or not after[0].sure:
                continue
            problem = self._problem(*taken[index])
            result = self._tracked(problem, after[0], after[1] if _chained(after) else None)
            cost = frame_cost(problem, result.lights)
            if cost <= self._limit(after) and result.status in ONE_ANSWER:
                kept[index] = TrackedFrame(in_order(result, after[0].result.lights), FrameStatus.TRACED_BACK, cost)
        return kept

    def _problem(self, images: Sequence[Tensor], capture: ImageCapture) -> LightProblem:
        stacked = self.views.prepared.stack_images(images)
        return LightProblem.create(self.views.prepared, stacked, self.views.effects, capture).sharpest()

    def _limit(self, frames: Sequence[TrackedFrame]) -> float:
        """The cost from which on a frame counts as lost, by frames near it: by the sure ones where there are any."""
        costs = [frame.cost for frame in frames if frame.sure] or [frame.cost for frame in frames]
        return self.options.lost * max(SMALL_COST, float(np.median(costs)))

    def _searched(self, images: Sequence[Tensor], capture: ImageCapture) -> FitResult:
        return fit_lights(
            self.views.prepared.frozen, self.views, images, search=self.search, spec=self.spec, capture=capture
        )

    def _tracked(self, problem: LightProblem, last: TrackedFrame, earlier: TrackedFrame | None) -> FitResult:
        """The lights followed from those of `last`, or from where another step like the one from `earlier` leads."""
        starts = self._starts(last, earlier)
        costs = [frame_cost(problem, tuple(emitter.light(torch.ones(3)) for emitter in rig)) for rig in starts]
        return fit_from(problem, starts[int(np.argmin(costs))], self.options.iterations)

    def _starts(self, last: TrackedFrame, earlier: TrackedFrame | None) -> list[Rig]:
        rig = self._emitters(last.result.lights)
        if earlier is None or len(earlier.result.lights) != len(rig):
            return [rig]
        return [predicted(self._emitters(earlier.result.lights), rig), rig]

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


def _chained(after: Sequence[TrackedFrame]) -> bool:
    """Whether of two frames one was followed from the other, so that the step between them says something."""
    return len(after) > 1 and (after[1].status == FrameStatus.TRACKED or after[0].status == FrameStatus.TRACED_BACK)


def _ambiguous(result: FitResult) -> FitResult:
    """What was followed from an ambiguous frame: as good as other answers that were not followed."""
    return replace(result, status=FitStatus.AMBIGUOUS, reason=REASONS[FitStatus.AMBIGUOUS])


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
