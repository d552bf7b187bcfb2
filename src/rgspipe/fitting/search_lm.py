"""`fit=search_lm`: candidates in closed form, then Levenberg-Marquardt on all lights, intensities in closed form."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

from rgspipe.fitting.certainty.doubts import doubts
from rgspipe.fitting.certainty.uncertainty import light_covariances
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.blocks import BlockModel, view_of_blocks
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.exposure import rough_exposures
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import MOST_LIGHTS, SearchOptions
from rgspipe.fitting.result import FitResult, dark_result
from rgspipe.fitting.search.coarse import CoarseImages
from rgspipe.fitting.search.judge import (
    CLEARLY_APART,
    DOUBTFUL_DROP,
    LEAST_DROP,
    best_state,
    distinct,
    drop,
    equally_good,
    ranked,
    rig_distance,
    robust_losses,
    worth_keeping,
    worth_one_more,
)
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import SHORT_ITERATIONS, refine_starts
from rgspipe.fitting.search.starts import Candidates, Rig
from rgspipe.fitting.search.weighting import PLAIN, ROBUST
from rgspipe.fitting.selection.one_less import one_light_less
from rgspipe.fitting.selection.one_more import one_more_light
from rgspipe.fitting.selection.verdict import Findings, SpareLight, counted_from, percent
from rgspipe.fitting.spec import LightSpec

#: Starts for each wanted one, where candidates have an axis.
AIMED_STARTS = 3

#: A number of lights that is known is searched from up to so many times the wanted starts, until the best one leaves
#: less than this share of the blocks' energy unexplained.
BATCHES, WELL_EXPLAINED = 4, 0.02

#: So many of the starts with the least robust losses, and of those that explain most, are refined with plain squares.
SETTLED = 2

#: A rival is refined, to see whether it is as good, unless the best rig's robust cost is lower by this share.
FAR_RIVAL = 0.5

#: A rival leaves at most so many times the energy unexplained that the best rig does.
RIVAL_ENERGY = 1.5


def fit_search_lm(
    problem: LightProblem,
    coarse: Sequence[CoarseImages],
    options: SearchOptions,
    spec: LightSpec | None = None,
    blocks: BlockModel | None = None,
) -> FitResult:
    """The lights that explain a target: refine the candidates that look most like it, polish the best.

    Args:
        coarse: the candidates' images, of point lights first where there are several.
        spec: what is known of the lights; one point light if None.
        blocks: the views as blocks of pixels, on which starts are refined; on all pixels if None.
    """
    meter, spec = Meter(), spec or LightSpec()
    if problem.black:
        return dark_result(meter.seconds)
    problem = _roughly_exposed(problem, coarse)
    candidates = [Candidates.of(problem, images, spec.shape_free) for images in coarse]
    candidates = [one for one in candidates if one.lit]
    if not candidates:
        return dark_result(meter.seconds)
    search = _Search(problem, Refiner.of(problem.coarsest(blocks), meter), candidates, options, spec)
    best = search.known(spec.count) if spec.count is not None else search.unknown()
    found = Findings(ambiguous=search.ambiguous(best), too_few=search.too_few(best), spare=search.spare(best))
    best = search.polish(best)
    if not bool((best.intensity > 0).any()):
        return dark_result(meter.seconds)
    return search.result(best, found)


def fit_from(problem: LightProblem, start: Sequence[Emitter], iterations: int = 30) -> FitResult:
    """Lights from known starts, by plain least squares: no search, no robust loss."""
    if problem.black:
        return dark_result(0.0)
    problem = problem.sharpest()
    refiner = Refiner.of(problem)
    search = _Search(problem, refiner, [], SearchOptions(iterations=iterations), LightSpec())
    return search.result(refiner.refined(refiner.start(start, PLAIN), PLAIN, iterations), Findings())


def _roughly_exposed(problem: LightProblem, coarse: Sequence[CoarseImages]) -> LightProblem:
    """The problem with free exposures near those of the single candidate that explains most, for the search."""
    if not problem.exposure_free or not len(coarse[0]):
        return problem
    images = coarse[0]
    target = images.blocks @ problem.target
    weights = problem.block_weights(target, images.counts.to(target), images.blocks)
    views = view_of_blocks(images.blocks, problem.views)
    return problem.with_exposures(rough_exposures(images.images, target, weights, views, len(problem.exposures)))


class _Search:
    """One target's search, and what it has tried.

    Everything is searched and decided on the refiner's problem, `coarse`, where a step costs little more than its
    shadow rays; what was chosen is then polished on `problem`.
    """

    def __init__(
        self,
        problem: LightProblem,
        refiner: Refiner,
        candidates: Sequence[Candidates],
        options: SearchOptions,
        spec: LightSpec,
    ) -> None:
        self.problem, self.coarse, self.refiner = problem, refiner.problem, refiner
        self.candidates, self.options, self.spec = candidates, options, spec
        self.region = refiner.region
        self.rivals: list[State] = []
        self.tried: list[State] = []

    def known(self, lights: int) -> State:
        """The best rig of a given number of lights; fewer where there are too few candidates."""
        best = None
        # Points and spots have candidates of their own, so rigs of both grow light by light.
        for count in range(1, lights + 1) if self.spec.type == "auto" else (lights,):
            best = self._best_of(count, best, patient=count == lights) or best
        while best is None:
            lights -= 1
            best = self._best_of(lights, None, patient=True)
        self.tried = [best]
        return self._settled([best]) if self.spec.type == "auto" else best

    def unknown(self) -> State:
        """The best rig of the least number of lights to which one more adds too little."""
        best, rivals = None, []
        for lights in range(1, MOST_LIGHTS + 1):
            state = self._best_of(lights, best, patient=False)
            if state is None:
                break
            # More steps rarely gain as much again, so a rig that is far from worth it needs none.
            if best is not None and drop(self.coarse, best, state) < 0.5 * LEAST_DROP:
                self.tried.append(state)
                break
            further = self.refiner.refined(state, ROBUST, 2 * SHORT_ITERATIONS)
            self.rivals = [further if rival is state else rival for rival in self.rivals]
            state = further
            self.tried.append(state)
            if best is not None and not worth_one_more(self.coarse, best, state):
                break
            best, rivals = state, self.rivals
        answer = self._without_twins(best)
        if len(answer.emitters) < len(best.emitters):
            self.tried.append(answer)
        # A rig of more lights, two of which are one, explains as much and is no other answer.
        self.rivals = [state for state in rivals if len(state.emitters) <= len(answer.emitters)]
        return answer

    def costs(self) -> dict[int, float]:
        """Robust cost by number of lights of all rigs that were compared, at one scale."""
        losses = robust_losses(self.coarse, self.tried) if self.tried else []
        return {len(state.emitters): float(loss.mean()) for state, loss in zip(self.tried, losses, strict=True)}

    def _best_of(self, lights: int, previous: State | None, patient: bool) -> State | None:
        """The best rig of `lights` lights of the types that are looked for; None without candidates for so many.

        Args:
            previous: a refined rig of one light fewer, to grow from.
            patient: whether further starts follow while all explain little.
        """
        self.rivals = []
        batches = BATCHES if patient else 1
        starts = [self._starts(one, lights, previous, batches) for one in self.candidates]
        found = [self._refined(rigs, batches) for rigs in starts if rigs]
        if not found:
            return None
        best = found[0]
        for richer in found[1:]:
            if drop(self.coarse, best, richer) >= LEAST_DROP:
                best = richer
        return self._with_plain_lights(best) if self.spec.type == "auto" else best

    def _starts(self, candidates: Candidates, lights: int, previous: State | None, batches: int) -> list[Rig]:
        aimed = candidates.coarse.axes is not None
        count = self.options.starts * (AIMED_STARTS if aimed else 1) * batches
        if previous is None or len(previous.emitters) != lights - 1:
            return candidates.rigs(lights, count, self.region.size)
        half = max(1, count // 2)
        extended = candidates.extended(previous, half, self.region.size)
        from_nothing = candidates.rigs(lights, half, self.region.size)
        return [rig for pair in zip_longest(extended, from_nothing) for rig in pair if rig is not None]

    def _refined(self, rigs: Sequence[Rig], batches: int) -> State:
        """The best of several starts after a few steps each; of `batches` parts the next ones only if need be.

        Rigs that are to be compared with others have the least robust loss; else they are settled.
        """
        compared = batches == 1 or self.spec.type == "auto"
        refined, size = [], math.ceil(len(rigs) / batches)
        for first in range(0, len(rigs), size):
            part, iterations = rigs[first : first + size], self.options.iterations
            refined += refine_starts(self.refiner, part, iterations, thorough=first > 0)
            best = best_state(self.coarse, refined) if compared else self._settled(refined)
            if self.refiner.unexplained(best) < WELL_EXPLAINED:
                break
        self.rivals += refined
        return best

    def _settled(self, states: Sequence[State]) -> State:
        """Of the best states the one that explains most after some steps of plain squares.

        The polish takes plain squares: a rig that only a forgiving loss likes, for which the brightest pixels are
        outliers, would walk far in it. So the best by plain squares are among those that are tried.
        """
        chosen = [*ranked(self.coarse, states)[:SETTLED], *sorted(states, key=self.refiner.unexplained)[:SETTLED]]
        steps = min(SHORT_ITERATIONS, self.options.iterations)
        settled = [self.refiner.refined(state, PLAIN, steps) for state in distinct(chosen, self.region.size)]
        return min(settled, key=self.refiner.unexplained)

    def _with_plain_lights(self, state: State) -> State:
        """The rig with plain lights in the place of those whose shapes explain too little."""
        for index, emitter in enumerate(state.emitters):
            if emitter.axis is not None:
                plain = [*state.emitters]
                plain[index] = Emitter(emitter.light.plain)
                other = self.refiner.refined(self.refiner.start(plain, ROBUST), ROBUST, SHORT_ITERATIONS)
                state = state if drop(self.coarse, other, state) >= LEAST_DROP else other
        return state

    def _without_twins(self, best: State) -> State:
        """The rig by plain squares. Lights that meet on the way there are one: with one fewer the search had failed."""
        settled = self._settled([self._pruned(best)])
        fewer = self._pruned(settled)
        return settled if fewer is settled else self._without_twins(fewer)

    def _pruned(self, state: State) -> State:
        """The rig without lights that add next to nothing or coincide with another."""
        kept = worth_keeping(state, self.region.size)
        if len(kept) == len(state.emitters) or not kept:
            return state
        fewer = self.refiner.start([state.emitters[index] for index in kept], ROBUST)
        return self.refiner.refined(fewer, ROBUST, 2 * SHORT_ITERATIONS)

    def ambiguous(self, best: State) -> bool:
        """Whether a clearly different rig explains the target as well; rivals that come near are refined first."""
        apart = CLEARLY_APART * self.region.size
        rivals = [state for state in self.rivals if rig_distance(state.emitters, best.emitters) > apart]
        if not rivals:
            return False
        rival = best_state(self.coarse, rivals)
        if drop(self.coarse, rival, best) > FAR_RIVAL:
            return False
        one, other = (self.refiner.refined(state, ROBUST, 2 * SHORT_ITERATIONS) for state in (best, rival))
        if rig_distance(one.emitters, other.emitters) <= apart or not equally_good(self.coarse, one, other):
            return False
        # The answer is one of plain squares, so a rival has to be one, too.
        other = self.refiner.refined(other, PLAIN, SHORT_ITERATIONS)
        clear = rig_distance(best.emitters, other.emitters) > apart
        return clear and self.refiner.unexplained(other) <= RIVAL_ENERGY * self.refiner.unexplained(best)

    def polish(self, best: State) -> State:
        """Plain squares to the end with all pixels, direct light where these look if views are ready for it."""
        self.problem = self.problem.sharpest()
        refiner = self.refiner.on(self.problem)
        return refiner.refined(refiner.at(best, best.emitters), PLAIN, self.options.iterations)

    def _settle_exposures(self, best: State) -> None:
        """Take free exposures as known from here on."""
        if self.problem.exposure_free:
            weights = PLAIN.at(self.problem, best.columns, best.intensity)
            exposures = self.problem.moments(best.columns, weights).exposures
            self.problem = replace(self.problem.with_exposures(exposures), exposure_free=False)

    def too_few(self, best: State) -> float:
        """By what share one light more than the known number lowers the robust cost; 0 where it is not worth it."""
        count = self.spec.count
        if count is None or count == MOST_LIGHTS or len(best.emitters) != count:
            return 0.0
        compared = one_more_light(self.refiner, self.candidates, best)
        if compared is None:
            return 0.0
        self.tried = [compared.simple, compared.rich]
        worth = worth_one_more(self.coarse, compared.simple, compared.rich)
        return drop(self.coarse, compared.simple, compared.rich) if worth else 0.0

    def spare(self, best: State) -> SpareLight | None:
        """A light of a known number that is not worth it; None if there is none."""
        if self.spec.count is None or len(best.emitters) < 2:
            return None
        compared = one_light_less(self.refiner, best)
        self.tried = [compared.simple, compared.rich, *self.tried[1:]]
        return None if compared.worth else SpareLight(compared.index + 1, compared.gain)

    def result(self, best: State, found: Findings) -> FitResult:
        self._settle_exposures(best)
        meter, last = self.refiner.meter, self.refiner.on(self.problem).step(best)
        costs, loss, lights = self.costs(), last.loss, last.lights
        spread = light_covariances(self.problem, best)
        at_bound = any(self.region.at_bound(emitter.position) for emitter in best.emitters)
        doubt = doubts(lights, spread.calibrated, self.problem.views.frozen.surfels, self.region.size)
        found = replace(found, at_bound=at_bound, loss=loss, doubt=doubt, ended=best.status)
        maybe = "" if found.too_few else _one_more(len(lights), costs)
        return FitResult(
            lights=lights,
            status=found.status,
            reason=" ".join(filter(None, (found.reason(len(lights)), maybe))),
            loss=loss,
            iterations=meter.iterations,
            evaluations=meter.evaluations,
            lights_tried=max([*costs, len(best.emitters)]),
            seconds=meter.seconds,
            covariance=spread.calibrated,
            trajectory=(*best.steps, last),
            costs=costs,
            exposures=tuple(self.problem.exposures.tolist()),
            noise_covariance=spread.noise,
        )


def _one_more(count: int, costs: Mapping[int, float]) -> str:
    """A sentence where one light more than were found might be there."""
    if count not in costs or count + 1 not in costs:
        return ""
    share = 1.0 - costs[count + 1] / costs[count]
    if share <= DOUBTFUL_DROP:
        return ""
    return f"One more light would lower the cost by {percent(share)}: there may be one (it counts {counted_from()})."
