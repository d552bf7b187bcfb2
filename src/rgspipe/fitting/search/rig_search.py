"""The search for a rig: starts from the candidates, refined and compared, of a given number of lights or as many as
it takes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

from rgspipe.fitting.course import BEAMS, POINTS, Course
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import MOST_LIGHTS, SearchOptions
from rgspipe.fitting.search.compare import best_state, distinct, drop, passed, worth_keeping
from rgspipe.fitting.search.promise import beam_promised
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import refined_starts
from rgspipe.fitting.search.starts import Candidates, EmitterRig
from rgspipe.fitting.search.weighting import PLAIN, ROBUST

#: Descents for each start: the better ones go on.
DESCENTS = 1.3


@dataclass(frozen=True)
class FoundRigs:
    """The rigs that a search found.

    Attributes:
        best: the answer.
        others: all rigs of its number that were refined to the end, the best one among them.
        compared: by number of lights the rigs that were compared.
    """

    best: State
    others: tuple[State, ...]
    compared: Mapping[int, State] = field(default_factory=dict)


@dataclass(frozen=True)
class RigSearch:
    """A search on one problem, where a step costs little more than its shadow rays.

    Attributes:
        refiner: on that problem.
        candidates: of each kind of light, the plainest first.
        options: how it searches.
        kinds_open: whether lights of several kinds stand against each other.
    """

    refiner: Refiner
    candidates: Sequence[Candidates]
    options: SearchOptions = field(default_factory=SearchOptions)
    kinds_open: bool = False

    @property
    def _course(self) -> Course:
        return self.refiner.meter.course

    def known(self, lights: int) -> FoundRigs:
        """The best rig of a given number of lights; fewer where there are too few candidates."""
        found = None
        # Kinds have candidates of their own, so rigs of several kinds grow light by light.
        for count in range(1, lights + 1) if self.kinds_open else (lights,):
            found = self._of(count, found and found.best, patient=count == lights) or found
        while found is None:
            lights -= 1
            found = self._of(lights, None, patient=True)
        best = self.settled([found.best]) if self.kinds_open else found.best
        return FoundRigs(best, found.others, {len(best.emitters): found.best})

    def unknown(self) -> FoundRigs:
        """The best rig of the least number of lights to which one more adds too little."""
        best, compared, bar = None, {}, self.options.bar
        for lights in range(1, MOST_LIGHTS + 1):
            if lights > 2:
                self._course.further(POINTS * lights)
            found = self._of(lights, best and best.best, patient=False)
            if found is None:
                break
            # More steps rarely gain as much again, so a rig that is far from worth it needs none.
            hopeless = best is not None and drop(self.refiner.problem, best.best, found.best) < bar.doubtful
            found = found if hopeless else self._further(found)
            compared[lights] = found.best
            if hopeless or (best is not None and not passed(self.refiner.problem, best.best, found.best, bar)):
                break
            best = found
        answer = self.without_twins(best.best)
        count = len(answer.emitters)
        if count < len(best.best.emitters):
            compared[count] = answer
        # A rig of more lights, two of which are one, explains as much and is no other answer.
        others = tuple(state for state in best.others if len(state.emitters) <= count)
        return FoundRigs(answer, others, compared)

    def settled(self, states: Sequence[State]) -> State:
        """Of the best states by either loss the one that explains most after some steps of plain squares.

        The polish takes plain squares: a rig that only a forgiving loss likes, for which the brightest pixels are
        outliers, would walk far in it. So the best one by plain squares is tried, too.
        """
        chosen = [best_state(self.refiner.problem, states), min(states, key=self.refiner.unexplained)]
        steps = min(self.options.schedule.steps, self.options.iterations)
        tried = distinct(chosen, self.options.schedule.met, self.refiner.region.size)
        return min((self.refiner.refined(state, PLAIN, steps) for state in tried), key=self.refiner.unexplained)

    def without_twins(self, best: State) -> State:
        """The rig by plain squares. Lights that meet on the way there are one: with one fewer the search had failed."""
        settled = self.settled([self._pruned(best)])
        fewer = self._pruned(settled)
        return settled if fewer is settled else self.without_twins(fewer)

    def _of(self, lights: int, previous: State | None, patient: bool) -> FoundRigs | None:
        """The best rig of `lights` lights; None without candidates for so many.

        Args:
            previous: a refined rig of one light fewer, to grow from.
            patient: whether further starts follow while all explain little.
        """
        batches = self.options.starts if patient else 1
        found: list[FoundRigs] = []
        for aimed in (False, True):
            kinds = [kind for kind in self.candidates if kind.aimed is aimed]
            if kinds and not (found and self._beamless(found[0].best)):
                found += self._tried(kinds, lights, previous, batches)
        if not found:
            return None
        best = found[0].best
        for richer in found[1:]:
            if drop(self.refiner.problem, best, richer.best) >= self.options.bar.least:
                best = richer.best
        best = self._with_plain_lights(best) if self.kinds_open else best
        return FoundRigs(best, tuple(state for one in found for state in one.others))

    def _tried(self, kinds: Sequence[Candidates], lights: int, previous: State | None, batches: int) -> list[FoundRigs]:
        """The best of starts of some kinds, if there are any."""
        words, effort = f"trying {lights} light{'s' * (lights != 1)}", POINTS * lights
        if kinds[0].aimed:
            words, effort = f"{words} with beams", BEAMS * lights
            self._course.further(effort)
        with self._course.part(words, effort) as part:
            starts = zip_longest(*(self._starts(kind, lights, previous, batches) for kind in kinds))
            rigs = [rig for row in starts for rig in row if rig is not None]
            part.pieces = DESCENTS * len(rigs) / batches
            return [self._refined(rigs, batches, previous)] if rigs else []

    def _beamless(self, state: State) -> bool:
        """Whether points explain the image, and no beam in the place of one promises to do so better."""
        if self.refiner.unexplained(state) > self.options.certainty.poorly:
            return False
        bar, lights = self.options.bar, range(len(state.emitters))
        return all(beam_promised(self.refiner, state, index).gain < bar.doubtful for index in lights)

    def _starts(self, candidates: Candidates, lights: int, previous: State | None, batches: int) -> list[EmitterRig]:
        size = self.refiner.region.size
        count = self.options.starts * (self.options.aimed.starts if candidates.aimed else 1) * batches
        if previous is None or len(previous.emitters) != lights - 1:
            return candidates.rigs(lights, count, size)
        half = max(1, count // 2)
        pairs = zip_longest(candidates.extended(previous, half, size), candidates.rigs(lights, half, size))
        return [rig for pair in pairs for rig in pair if rig is not None]

    def _refined(self, rigs: Sequence[EmitterRig], batches: int, previous: State | None) -> FoundRigs:
        """The best of several starts after a few steps each; of `batches` parts the next ones only if need be.

        Rigs that are to be compared with others have the least robust loss; else they are settled.
        """
        compared = batches == 1 or self.kinds_open
        refined, size = [], math.ceil(len(rigs) / batches)
        for first in range(0, len(rigs), size):
            part = rigs[first : first + size]
            refined += refined_starts(self.refiner, part, self.options.iterations, self.options.schedule, previous)
            best = best_state(self.refiner.problem, refined) if compared else self.settled(refined)
            if self.refiner.unexplained(best) < self.options.certainty.poorly:
                break
        return FoundRigs(best, tuple(refined))

    def _further(self, found: FoundRigs) -> FoundRigs:
        """The same with more steps of the best rig."""
        further = self.refiner.refined(found.best, ROBUST, 2 * self.options.schedule.steps)
        return FoundRigs(further, tuple(further if state is found.best else state for state in found.others))

    def _with_plain_lights(self, state: State) -> State:
        """The rig with plain lights in the place of those whose shapes explain too little."""
        for index, emitter in enumerate(state.emitters):
            if emitter.light.plain is not emitter.light:
                plain = [*state.emitters]
                plain[index] = Emitter(emitter.light.plain)
                other = self.refiner.refined(
                    self.refiner.start(plain, ROBUST, state), ROBUST, self.options.schedule.steps
                )
                state = state if drop(self.refiner.problem, other, state) >= self.options.bar.least else other
        return state

    def _pruned(self, state: State) -> State:
        """The rig without lights that add next to nothing or coincide with another."""
        kept = worth_keeping(state, self.options.bar, self.options.schedule.met, self.refiner.region.size)
        if len(kept) == len(state.emitters) or not kept:
            return state
        fewer = self.refiner.start([state.emitters[index] for index in kept], ROBUST, state)
        return self.refiner.refined(fewer, ROBUST, 2 * self.options.schedule.steps)
