"""`fit=search_lm`: candidates in closed form, then Levenberg-Marquardt on all lights, intensities in closed form.

A target is searched on blocks of pixels, where the number and rivals of the answer are doubted (`searched`); what was
chosen is polished on all pixels and told how sure it is (`certainty`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import torch

from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.certainty.behind_surfaces import behind_surfaces
from rgspipe.fitting.certainty.minima import holding
from rgspipe.fitting.certainty.uncertainty import light_covariances
from rgspipe.fitting.course import BRIGHT_SPOTS, POLISH, weight
from rgspipe.fitting.findings import Finding, FitStatus, LightMissing, LightSpare, MuchAmbient, NoOpening
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.moments import moments
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.polish import exposed, polished_on_pixels, seen_well
from rgspipe.fitting.result import FitResult, dark_result
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.searched import Searched, strengths
from rgspipe.fitting.selection.alternatives import least_bad, still_apart, weighed
from rgspipe.fitting.selection.ambient import ambient_found, ambient_missing, ambient_open
from rgspipe.fitting.selection.diagnosis import Costs, hanging, standing
from rgspipe.fitting.selection.number import faded_light
from rgspipe.fitting.selection.rivals import as_good_nearby, rival_elsewhere, rival_polished, told_rival
from rgspipe.fitting.selection.tables import tables_open
from rgspipe.fitting.spec import LightSpec


def polished(
    problem: LightProblem, found: Searched | None, options: SearchOptions, spec: LightSpec, meter: Meter
) -> FitResult:
    """What was found by `searched`, if anything was, polished on all pixels and told.

    Args:
        problem: of all pixels; more, perhaps, than were searched.
        meter: the search's.
    """
    if problem.black:
        return dark_result(0.0)
    if found is None:
        dark = _without_lights(problem, meter)
        return replace(dark, findings=(*dark.findings, NoOpening())) if spec.kinds[-1].distant else dark
    problem, rigs = found.on(problem)
    # Which of those that blocks do not tell apart is the answer, pixels say.
    refiner, (best, *others) = polished_on_pixels(found.refiner, problem, rigs, options)
    if not bool((best.intensity[: len(best.emitters)] > 0).any()):
        return _without_lights(refiner.problem, meter)
    findings = _findings(found, refiner, best, options, spec)
    # Whoever begins elsewhere than at the scene's candidates need not have any: they take seconds. The scene that was
    # searched has them; in which bright spots are seen well, they would be made anew.
    scene, shadows = problem.views.frozen, problem.model.effects.shadows
    findings = (*findings, *behind_surfaces(best.lights(refiner.problem), scene, shadows))
    costs = Costs.of(found.refiner, found.compared)
    return _result(refiner, best, findings, costs, options, others, found.weighed)


def _findings(
    found: Searched, refiner: Refiner, best: State, options: SearchOptions, spec: LightSpec
) -> tuple[Finding, ...]:
    """What a search found out, as far as pixels bear it out, and what they tell besides."""
    blocks, findings = found.refiner, found.findings
    if options.bar.unnoticed(refiner.unexplained(best)):
        # What blocks miss there is what they do not see: shadows' edges.
        findings = tuple(one for one in findings if not isinstance(one, LightMissing))
    if spec.count is not None and not any(isinstance(finding, LightSpare) for finding in findings):
        findings = (*findings, *faded_light(blocks, best, options))
    if spec.ambient:
        return (*findings, *ambient_found(refiner.problem, best, options.bar))
    return (*findings, *ambient_missing(blocks, found.candidates, found.best, findings, options))


def fit_from(
    problem: LightProblem, start: Sequence[Emitter], iterations: int = 30, options: SearchOptions | None = None
) -> FitResult:
    """Lights from known starts, by plain least squares: no search, no robust loss."""
    options = options or SearchOptions()
    if problem.black:
        return dark_result(0.0)
    size = weight(start)
    with Meter.shown((POLISH + BRIGHT_SPOTS) * size) as meter:
        refiner, course = Refiner.of(problem.sharpest(), meter), meter.course
        with course.polishing(size, 1):
            best = refiner.refined(refiner.start(start, PLAIN), PLAIN, iterations)
        refiner = exposed(refiner, best)
        if best.status is FitStatus.CONVERGED:
            with course.part("bright spots", BRIGHT_SPOTS * size):
                refiner, (best,) = seen_well(refiner, [best], options)
        return _result(refiner, best, (), Costs({}), options)


def _result(
    refiner: Refiner,
    best: State,
    findings: Sequence[Finding],
    costs: Costs,
    options: SearchOptions,
    others: Sequence[State] = (),
    earlier: Sequence[Alternative] = (),
) -> FitResult:
    problem, meter, last = refiner.problem, refiner.meter, refiner.step(best)
    spread = light_covariances(problem, best, options.certainty)
    # They may have found other exposures.
    others = [refiner.start(other.emitters, PLAIN, other) for other in others]
    near = as_good_nearby(refiner, best, others, options)
    certainty = holding(spread.calibrated, best, near, problem.scale, refiner.region.size)
    rival = rival_polished(refiner, best, others, options) or rival_elsewhere(refiner, best, certainty, options)
    rivals = [] if rival is None else [rival]
    told = weighed(refiner, best, [*rivals, *others], findings, options)
    told += still_apart(refiner, best, earlier, told, options.certainty.doubtful)
    open_tables = tables_open(refiner, best, others, options)
    known = strengths(problem, best, spread.known)
    findings = (*(told_rival(refiner, best, other) for other in rivals), *findings, *open_tables)
    if "ambient" in known:
        findings = (*findings, *ambient_open(known["ambient"], problem.scale))
    return FitResult(
        lights=last.lights,
        findings=(*standing(refiner, best, certainty, options.certainty), *findings, *hanging(best)),
        loss=last.loss,
        iterations=meter.iterations,
        evaluations=meter.evaluations,
        lights_tried=max([*costs.by_count, len(best.emitters)]),
        seconds=meter.seconds,
        covariance=certainty,
        trajectory=(*best.steps, last),
        costs=costs.by_count,
        exposures=tuple(problem.exposures.tolist()),
        noise_covariance=spread.noise,
        alternatives=tuple(least_bad(told)),
        **known,
    )


def _without_lights(problem: LightProblem, meter: Meter) -> FitResult:
    """The result for a target that known images alone explain, or nothing."""
    result = dark_result(meter.seconds)
    if not problem.known:
        return result
    columns, weights = problem.known_columns, problem.unclipped(PLAIN.base(problem).square())
    found = problem.moments(columns, weights)
    state, gram = State((), columns, found.intensity), moments(columns, problem.target, weights).values
    variance = found.cost / max(1, problem.target.numel() - found.intensity.numel())
    spreads = [torch.diag(variance * one.unit**2 / gram[:, k, k]) for k, one in enumerate(problem.known)]
    known = strengths(problem, state, spreads)
    told = [MuchAmbient(known["ambient"].share)] if "ambient" in known else []
    told += [] if "ambient" not in known else ambient_open(known["ambient"], problem.scale)
    loss = problem.unexplained(columns, found.intensity)
    return replace(result, findings=(*result.findings, *told), loss=loss, **known)
