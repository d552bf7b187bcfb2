"""How far a fit is, told in a line of progress.

What a fit takes is not known beforehand: how many lights are tried, whether beams are, and how many answers are
polished turn out on the way. So every part has an effort, which was measured; what is left is counted in efforts, at
the pace of this fit so far; and what turns out to be needed is added once it does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Self

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.spec import LightSpec
from rgspipe.progress import ProgressBar, progress_bar

#: Efforts of trying starts of one light (of L lights L times as much): seconds in the room of the demo, with three
#: photographs of 128² and a busy processor.
POINTS, BEAMS = 0.8, 7.0

#: Efforts of what follows, for one point; for others `weight` times as much. Answers are polished on few pixels, and on
#: all.
KINDS, BLOCKS_BESIDE, POLISH, BESIDE, BRIGHT_SPOTS = 0.4, 0.3, 0.6, 0.4, 0.25

#: Efforts of what comes first and last.
BEGINNING, CERTAINTY = 1.0, 0.2

#: What an answer takes grows with this power of its lights.
GROWTH = 1.5

#: Steps of a descent that ends by itself: measured 3 to 12.
USUAL_STEPS = 6


@dataclass
class Part:
    """What is under way.

    Attributes:
        begin: effort up to it.
        effort: of all of it.
        pieces: about how many it has.
        done: how many of them are done.
    """

    begin: float = 0.0
    effort: float = 0.0
    pieces: float = 1.0
    done: int = 0

    def reached(self, of_next: float) -> float:
        """The effort up to some part of the next piece; there may be more of them than was thought."""
        return self.begin + self.effort * (self.done + of_next) / max(self.done + 1.0, self.pieces)


class Course:
    """A fit on its way.

    Args:
        bar: where it is shown, whose total is the effort; None if nowhere.
    """

    def __init__(self, bar: ProgressBar | None = None) -> None:
        self._bar, self._part = bar, Part()

    @classmethod
    @contextmanager
    def shown(cls, effort: float) -> Iterator[Self]:
        """A course of some effort, which is shown while it takes."""
        with progress_bar([], "looking for lights", total=effort, whole=True) as bar:
            yield cls(bar)

    def further(self, effort: float) -> None:
        """More is to be done than was known."""
        if self._bar is not None:
            self._bar.total += effort

    @contextmanager
    def part(self, words: str, effort: float, pieces: float = 1.0) -> Iterator[Part]:
        """A part of the fit, of about so many pieces: descents, or what else `piece` counts."""
        part = self._part = Part(0.0 if self._bar is None else self._bar.n, effort, pieces)
        if self._bar is not None:
            self._bar.total = max(self._bar.total, part.begin + effort)
            self._bar.set_description_str(words, refresh=False)
        yield part
        self._reach(part.begin + effort)
        self._part = Part()

    def polishing(self, weight: float, answers: int, planned: int = 1) -> AbstractContextManager[Part]:
        """The part in which so many answers, of which some were planned, are polished."""
        self.further(POLISH * weight * (answers - planned))
        return self.part("polishing", POLISH * weight * answers, answers)

    def step(self, taken: int, most: int) -> None:
        """Of a descent, the next piece, so many steps of at most so many are taken."""
        self._reach(self._part.reached(taken / max(taken + 1.0, min(USUAL_STEPS, most))))

    def piece(self) -> None:
        """A piece is done."""
        self._part.done += 1
        self._reach(self._part.reached(0.0))

    def _reach(self, effort: float) -> None:
        if self._bar is not None and effort > self._bar.n:
            self._bar.update(effort - self._bar.n)


def effort_of(spec: LightSpec) -> float:
    """What a fit takes as far as is known when it begins: with an unknown number that there is one light."""
    return effort_of_search(spec) + effort_after((spec.count or 1) ** GROWTH) + CERTAINTY


def effort_of_search(spec: LightSpec) -> float:
    """What comes before lights are chosen, as far as is known when it begins."""
    tried = 2 if spec.count is None else spec.count
    first = 1 if spec.count is None or len(spec.kinds) > 1 else tried
    return BEGINNING + POINTS * sum(range(first, tried + 1))


def effort_after(weight: float) -> float:
    """What comes once the lights are chosen."""
    return (KINDS + BLOCKS_BESIDE + 2.0 * POLISH + BESIDE + BRIGHT_SPOTS) * weight


def weight(emitters: Sequence[Emitter]) -> float:
    """How many times as much an answer takes as a point: every light is rendered, and adds unknowns, a beam twice.

    Polishing took 2.5 times as much for two points, 6.3 times for three, 3.6 for a spot and 6.5 for two.

    One with an extent is rendered point by point: measured 16 times as much for a panel, 3 to 5 times for a sphere.
    """
    points = max((len(emitter.light.parts(few=True)) for emitter in emitters), default=1)
    return points * sum(1 if emitter.axis is None else 2 for emitter in emitters) ** GROWTH
