"""`fit=search_lm`: candidates in closed form, then Levenberg-Marquardt on all lights, intensities in closed form."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rgspipe.fitting.coarse import CoarseImages
from rgspipe.fitting.exposure import rough_exposures
from rgspipe.fitting.judge import (
    CLEARLY_APART,
    LEAST_DROP,
    best_state,
    drop,
    equally_good,
    rig_distance,
    robust_losses,
    worth_keeping,
)
from rgspipe.fitting.parameters import Emitter
from rgspipe.fitting.problem import LightProblem
from rgspipe.fitting.refine import (
    PLAIN,
    ROBUST,
    Region,
    State,
    reevaluate,
    refine,
    search_region,
    start_from,
    weights_at,
)
from rgspipe.fitting.result import REASONS, FitResult, FitStatus, dark_result
from rgspipe.fitting.schedule import SHORT_ITERATIONS, refine_starts
from rgspipe.fitting.spec import MOST_LIGHTS, LightSpec
from rgspipe.fitting.starts import Candidates, Rig
from rgspipe.fitting.uncertainty import doubts, light_covariances

#: Starts for each wanted one, where spots are among the candidates.
SPOT_STARTS = 3

#: A rival is refined, to see whether it is as good, if its robust cost is below this many times the best.
NEAR_RIVAL = 2.0


@dataclass(frozen=True)
class SearchOptions:
    """How `search_lm` searches.

    Attributes:
        starts: best candidates that are refined.
        iterations: most Levenberg-Marquardt steps of the final refinement.
    """

    starts: int = 4
    iterations: int = 30


def fit_search_lm(
    problem: LightProblem,
    coarse: Sequence[CoarseImages],
    options: SearchOptions,
    spec: LightSpec | None = None,
) -> FitResult:
    """The lights that explain a target: refine the candidates that look most like it, polish the best.

    Args:
        coarse: the candidates' images, of point lights first where there are several.
        spec: what is known of the lights; one point light if None.
    """
    begin = time.perf_counter()
    spec = spec or LightSpec()
    if problem.black:
        return dark_result(time.perf_counter() - begin)
    problem = _roughly_exposed(problem, coarse)
    candidates = [Candidates.of(problem, images, spec.cone_free) for images in coarse]
    candidates = [one for one in candidates if one.lit]
    if not candidates:
        return dark_result(time.perf_counter() - begin)
    search = _Search(problem, candidates, options, spec, search_region(problem), begin)
    best, costs = search.known(spec.count) if spec.count is not None else search.unknown()
    ambiguous = search.ambiguous(best)
    search.polish(best)
    if not bool((best.intensity > 0).any()):
        return dark_result(time.perf_counter() - begin)
    return search.result(best, costs, ambiguous)


def fit_from(problem: LightProblem, start: Sequence[Emitter], iterations: int = 30) -> FitResult:
    """Lights from known starts, by plain least squares: no search, no robust loss."""
    begin = time.perf_counter()
    if problem.black:
        return dark_result(0.0)
    search = _Search(problem.sharpest(), [], SearchOptions(0, iterations), LightSpec(), search_region(problem), begin)
    state = start_from(search.problem, start, PLAIN, begin)
    refine(search.problem, state, PLAIN, iterations, search.region, begin)
    search.states.append(state)
    return search.result(state, {}, False)


def _roughly_exposed(problem: LightProblem, coarse: Sequence[CoarseImages]) -> LightProblem:
    """The problem with free exposures near those of the single candidate that explains most, for the search."""
    if not problem.exposure_free or not len(coarse[0]):
        return problem
    images = coarse[0]
    target = images.blocks @ problem.target
    weights = problem.block_weights(target, images.counts.to(target), images.blocks)
    matrix = images.blocks.matrix
    # Blocks do not reach over views: their first pixel says which one they are of.
    views = problem.views.view_of[matrix.col_indices()[matrix.crow_indices()[:-1].long()].long()]
    return problem.with_exposures(rough_exposures(images.images, target, weights, views, len(problem.exposures)))


class _Search:
    """One target's search, and what it has tried."""

    def __init__(
        self,
        problem: LightProblem,
        candidates: Sequence[Candidates],
        options: SearchOptions,
        spec: LightSpec,
        region: Region,
        begin: float,
    ) -> None:
        self.problem, self.candidates, self.options, self.spec = problem, candidates, options, spec
        self.region, self.begin = region, begin
        self.states: list[State] = []
        self.rivals: list[State] = []

    def known(self, lights: int) -> tuple[State, dict[int, float]]:
        """The best rig of a given number of lights (fewer where there are too few candidates), and its cost."""
        best = None
        # Points and spots have candidates of their own, so rigs of both grow light by light.
        for count in range(1, lights + 1) if self.spec.type == "auto" else (lights,):
            best = self._best_of(count, best) or best
        while best is None:
            lights -= 1
            best = self._best_of(lights, None)
        return best, self._costs([best])

    def unknown(self) -> tuple[State, dict[int, float]]:
        """The best rig of the least number of lights to which one more adds too little, and the costs of all tried."""
        best, tried = None, []
        for lights in range(1, MOST_LIGHTS + 1):
            state = self._best_of(lights, best)
            if state is None:
                break
            tried.append(state)
            # More steps rarely gain as much again, so a rig that is far from worth it needs none.
            if best is not None and drop(self.problem, best, state) < 0.5 * LEAST_DROP:
                break
            refine(self.problem, state, ROBUST, 2 * SHORT_ITERATIONS, self.region, self.begin)
            if best is not None and drop(self.problem, best, state) < LEAST_DROP:
                break
            best, rivals = state, self.rivals
        self.rivals = rivals
        return self._pruned(best), self._costs(tried)

    def _costs(self, tried: Sequence[State]) -> dict[int, float]:
        """Robust cost by number of lights, all at one scale."""
        losses = robust_losses(self.problem, tried)
        return {len(state.emitters): float(loss.mean()) for state, loss in zip(tried, losses, strict=True)}

    def _best_of(self, lights: int, previous: State | None) -> State | None:
        """The best rig of `lights` lights of the types that are looked for; None without candidates for so many."""
        self.rivals = []
        starts = [self._starts(one, lights, previous) for one in self.candidates]
        found = [self._refined(rigs) for rigs in starts if rigs]
        if not found:
            return None
        best = found[0]
        for richer in found[1:]:
            if drop(self.problem, best, richer) >= LEAST_DROP:
                best = richer
        return self._with_plain_lights(best) if self.spec.type == "auto" else best

    def _starts(self, candidates: Candidates, lights: int, previous: State | None) -> list[Rig]:
        spots = candidates.coarse.axes is not None
        count = self.options.starts * (SPOT_STARTS if spots else 1)
        if previous is None or len(previous.emitters) != lights - 1:
            return candidates.rigs(lights, count, self.region.size)
        half = max(1, count // 2)
        extended = candidates.extended(previous, half, self.region.size)
        return [*extended, *candidates.rigs(lights, half, self.region.size)]

    def _refined(self, rigs: Sequence[Rig]) -> State:
        """The best of several starts after a few steps each."""
        started, finished = refine_starts(self.problem, rigs, self.options.iterations, self.region, self.begin)
        self.states += started
        self.rivals += finished
        return best_state(self.problem, finished)

    def _start(self, rig: Rig) -> State:
        state = start_from(self.problem, rig, ROBUST, self.begin)
        self.states.append(state)
        return state

    def _with_plain_lights(self, state: State) -> State:
        """The rig with point lights in the place of those spots whose cones explain too little."""
        for index, emitter in enumerate(state.emitters):
            if emitter.is_spot:
                plain = [*state.emitters]
                plain[index] = Emitter(emitter.position)
                other = self._start(tuple(plain))
                refine(self.problem, other, ROBUST, SHORT_ITERATIONS, self.region, self.begin)
                state = state if drop(self.problem, other, state) >= LEAST_DROP else other
        return state

    def _pruned(self, state: State) -> State:
        """The rig without lights that add next to nothing or coincide with another."""
        kept = worth_keeping(state, self.region.size)
        if len(kept) == len(state.emitters) or not kept:
            return state
        fewer = self._start(tuple(state.emitters[index] for index in kept))
        refine(self.problem, fewer, ROBUST, 2 * SHORT_ITERATIONS, self.region, self.begin)
        return fewer

    def ambiguous(self, best: State) -> bool:
        """Whether a clearly different rig explains the target as well; rivals that come near are refined first."""
        rivals = [
            state
            for state in self.rivals
            if rig_distance(state.emitters, best.emitters) > CLEARLY_APART * self.region.size
        ]
        if not rivals:
            return False
        rival = best_state(self.problem, rivals)
        losses = [float(loss.mean()) for loss in robust_losses(self.problem, [best, rival])]
        if losses[1] > NEAR_RIVAL * losses[0]:
            return False
        pair = [replace(state, steps=[], evaluations=0, iterations=0) for state in (best, rival)]
        self.states += pair
        for state in pair:
            refine(self.problem, state, ROBUST, 2 * SHORT_ITERATIONS, self.region, self.begin)
        apart = rig_distance(pair[0].emitters, pair[1].emitters) > CLEARLY_APART * self.region.size
        return apart and equally_good(self.problem, *pair)

    def polish(self, best: State) -> None:
        """Plain squares to the end, with direct light where pixels look if the views were made ready for that."""
        sharpest = self.problem.sharpest()
        if sharpest is not self.problem:
            self.problem = sharpest
            reevaluate(self.problem, best)
        refine(self.problem, best, PLAIN, self.options.iterations, self.region, self.begin)

    def _settle_exposures(self, best: State) -> None:
        """Take free exposures as known from here on."""
        if self.problem.exposure_free:
            weights = weights_at(self.problem, best, PLAIN, PLAIN.base(self.problem))
            exposures = self.problem.moments(best.columns, weights).exposures
            self.problem = replace(self.problem.with_exposures(exposures), exposure_free=False)

    def result(self, best: State, costs: dict[int, float], ambiguous: bool) -> FitResult:
        self._settle_exposures(best)
        status = best.status
        if ambiguous:
            status = FitStatus.AMBIGUOUS
        if any(self.region.at_bound(emitter.position) for emitter in best.emitters):
            status = FitStatus.AT_BOUND
        lights, spread = best.lights(self.problem), light_covariances(self.problem, best)
        return FitResult(
            lights=lights,
            status=status,
            reason=" ".join(filter(None, (REASONS[status], doubts(lights, spread.calibrated, self.region.size)))),
            loss=self.problem.unexplained(best.columns, best.intensity),
            iterations=sum(state.iterations for state in self.states),
            evaluations=sum(state.evaluations for state in self.states),
            lights_tried=max([*costs, len(best.emitters)]),
            seconds=time.perf_counter() - self.begin,
            covariance=spread.calibrated,
            trajectory=(*best.steps, best.record(self.problem, self.begin)),
            costs=costs,
            exposures=tuple(self.problem.exposures.tolist()),
            noise_covariance=spread.noise,
        )
