"""A search that finds out which pixels are lamps in sight, and looks for lights in all others.

What is striking enough is left out at once. Everything else is fitted first, as if there were no lamps in sight: only
where that explains little, all that may be a lamp is left out, and it is searched again. Suspects are lamps if the
lights that were found without them do not light them: else they come back, and where all do, those lights are polished
on what they light, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from torch import Tensor

from rgspipe.fitting.course import effort_of, effort_of_search
from rgspipe.fitting.in_sight.lamp import LampInSight, Mask, given_lamps
from rgspipe.fitting.in_sight.lookout import Answer, Lookout, poorly_explained
from rgspipe.fitting.in_sight.suspects import POSSIBLE
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.searched import Searched
from rgspipe.fitting.solvers import Search, Solver
from rgspipe.fitting.target_views import TargetViews

#: A fit is made again where most of what was left out for it are no lamp's pixels, nor beside them; but not more often.
ROUNDS = 3


def fit_without(
    views: TargetViews, images: Tensor, capture: ImageCapture, solver: Solver, masks: Sequence[Mask]
) -> FitResult:
    """A fit that leaves out given pixels of lamps, masks (H, W) bool, one a view."""
    search = solver if isinstance(solver, SearchOptions) else SearchOptions()
    lookout, lamps = Lookout(views, images, capture, search), given_lamps(masks)
    if not lamps:
        return solver.fit(views, images, capture)
    return lookout.told(Answer(solver.fit(lookout.without(lamps), images, capture), lamps))


def fit_on_lookout(views: TargetViews, images: Tensor, capture: ImageCapture, solver: Search) -> FitResult:
    """A fit that leaves out the lamps that it finds in sight; without any it is that of all pixels."""
    with Meter.shown(effort_of(views.lights)) as meter:
        result = _Fits(Lookout(views, images, capture, solver), solver, meter).best()
        return replace(result, seconds=meter.seconds, iterations=meter.iterations, evaluations=meter.evaluations)


@dataclass(frozen=True)
class _Trial:
    """What comes of a search without suspects.

    Attributes:
        answer: without those that are lamps; None if none is, or no light was found.
        lit: what was searched, where its lights light all suspects; of the pixels that `views` have.
    """

    answer: Answer | None = None
    lit: Searched | None = None
    views: TargetViews | None = None


@dataclass(frozen=True)
class _Fits:
    """Fits of one target to whichever of its pixels."""

    lookout: Lookout
    solver: Search
    meter: Meter

    def best(self) -> FitResult:
        """The fit that explains most, with lamps left out if there are any."""
        lookout = self.lookout
        # Pools of narrow lights end as sharply as lamps do, so images that may hold some are fitted first.
        aimed = any(kind.axis is not None for kind in lookout.views.lights.kinds)
        striking = _Trial() if aimed else self.without(lookout.striking())
        if striking.answer is not None and not poorly_explained(striking.answer.result):
            return lookout.told(striking.answer)
        whole = self.whole(striking)
        if poorly_explained(whole):
            possible = lookout.striking() if aimed else [*lookout.suspects(POSSIBLE), *lookout.saturated]
            answers = [one for one in (self.without(possible).answer, striking.answer) if one is not None]
            answers = [one for one in answers if lookout.far_better(one, whole) and (not aimed or lookout.sure(one))]
        else:
            answers = [one for one in (self.without(lookout.doubtful(whole)).answer,) if one is not None]
        return lookout.told(answers[0]) if answers else whole

    def without(self, suspects: Sequence[LampInSight]) -> _Trial:
        """A fit without those of some suspects that it does not light."""
        kept, found, views = suspects, None, None
        for last in (*[False] * (ROUNDS - 1), True):
            if not kept:
                return _Trial(None, found, views)
            if not self.lookout.enough_without(kept):
                return _Trial()
            lamps, views = kept, self.lookout.without(kept)
            found = self.searched(views)
            if found is None:
                return _Trial()
            # Blocks tell most of them apart, and pixels what is left.
            kept = self.lookout.confirmed(lamps, found.roughly())
            if kept and (last or _agree(lamps, kept)):
                result = self.polished(found, views)
                kept = self.lookout.confirmed(lamps, result)
                if not result.lights:
                    return _Trial()
                if last or _agree(lamps, kept):
                    return _Trial(Answer(result, lamps))
        return _Trial(None, found, views)

    def whole(self, striking: _Trial) -> FitResult:
        """A fit of all pixels: of lights that were found without some, if they explain these as well as the others."""
        views, lit = self.lookout.views, striking.lit
        if lit is not None and lit.unexplained <= self.solver.certainty.poorly:
            result = self.polished(lit, views)
            if self.lookout.explains_more(result, striking.views):
                return result
        return self.polished(self.searched(views), views)

    def searched(self, views: TargetViews) -> Searched | None:
        """What a search of `views` finds."""
        if self.meter.iterations:
            self.meter.course.further(effort_of_search(views.lights))
        return self.solver.searched(views, self.lookout.images, self.lookout.capture, self.meter)

    def polished(self, found: Searched | None, views: TargetViews) -> FitResult:
        """What was searched, polished on the pixels of `views`."""
        return self.solver.polished(found, views, self.lookout.images, self.lookout.capture, self.meter)


def _agree(before: Sequence[LampInSight], after: Sequence[LampInSight]) -> bool:
    """Whether what was left out holds all that had to be, little more, and nothing that was no lamp."""
    for view in {lamp.view for lamp in (*before, *after)}:
        out = [lamp for lamp in before if lamp.view == view]
        wanted = [lamp for lamp in after if lamp.view == view]
        if any(not any((lamp.core & one.pixels).any() for one in wanted) for lamp in out):
            return False
        left, core, most = (np.any(masks, axis=0) for masks in _masks(out, wanted))
        if (core & ~left).any() or 2 * (left & ~most).sum() > left.sum():
            return False
    return True


def _masks(out: Sequence[LampInSight], wanted: Sequence[LampInSight]) -> tuple[list[Mask], list[Mask], list[Mask]]:
    """Of one view: what was left out, what has to be, and what may be."""
    return [lamp.pixels for lamp in out], [lamp.core for lamp in wanted], [lamp.pixels for lamp in wanted]
