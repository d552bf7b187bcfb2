"""`fit=search_lm`: candidates in closed form, then Levenberg-Marquardt on all lights, intensities in closed form.

A target is searched on blocks of pixels (`search`), the number and rivals of the answer are doubted there
(`selection`), and what was chosen is polished on all pixels and told how sure it is (`certainty`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.certainty.minima import holding
from rgspipe.fitting.certainty.uncertainty import light_covariances
from rgspipe.fitting.course import (
    BEGINNING,
    BLOCKS_BESIDE,
    BRIGHT_SPOTS,
    GROWTH,
    KINDS,
    POLISH,
    Course,
    effort_after,
    effort_of,
    weight,
)
from rgspipe.fitting.findings import Finding, FitStatus, LightMissing, LightSpare, MuchAmbient, NoOpening
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.exposure import rough_exposures
from rgspipe.fitting.model.known_images import FIELDS, Strength
from rgspipe.fitting.model.moments import moments
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.polish import polished_on_pixels, seen_well
from rgspipe.fitting.result import FitResult, dark_result
from rgspipe.fitting.search.beside import settled_beside, steps_aside
from rgspipe.fitting.search.coarse import CoarseImages
from rgspipe.fitting.search.compare import column_energies
from rgspipe.fitting.search.grow import grown
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.rig_search import RigSearch
from rgspipe.fitting.search.starts import Candidates
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.alternatives import least_bad, still_apart, weighed
from rgspipe.fitting.selection.ambient import ambient_found, ambient_missing
from rgspipe.fitting.selection.diagnosis import Costs, hanging, standing
from rgspipe.fitting.selection.kinds import told_kinds
from rgspipe.fitting.selection.number import Doubted, doubted_number, faded_light
from rgspipe.fitting.selection.rivals import (
    as_good_nearby,
    leaves_as_little,
    rival_among,
    rival_elsewhere,
    rival_polished,
    told_rival,
)
from rgspipe.fitting.selection.tables import tables_open, told_tables
from rgspipe.fitting.spec import AUTO, LightSpec
from rgspipe.renderer.images.blocks import view_of_blocks
from rgspipe.renderer.images.model import ImageModel


def fit_search_lm(
    problem: LightProblem,
    coarse: Sequence[CoarseImages],
    options: SearchOptions,
    spec: LightSpec | None = None,
    blocks: ImageModel | None = None,
) -> FitResult:
    """The lights that explain a target: refine the candidates that look most like it, polish the best.

    Args:
        coarse: the candidates' images, of the plainest kind of light first where there are several.
        spec: what is known of the lights; one point light if None.
        blocks: the views as blocks of pixels, on which starts are refined; on all pixels if None.
    """
    spec = spec or LightSpec()
    if problem.black:
        return dark_result(0.0)
    with Course.shown(effort_of(spec)) as course:
        return _fitted(problem, coarse, options, spec, blocks, Meter(course=course))


def _fitted(
    problem: LightProblem,
    coarse: Sequence[CoarseImages],
    options: SearchOptions,
    spec: LightSpec,
    blocks: ImageModel | None,
    meter: Meter,
) -> FitResult:
    """`fit_search_lm` of a target that is not black."""
    course = meter.course
    problem = _roughly_exposed(problem, coarse)
    free = [spec.seed.free(images.shapes[0]) for images in coarse]
    pairs = zip(coarse, free, strict=True)
    with course.part("looking at candidates", BEGINNING):
        candidates = [Candidates.of(problem, images, shape_free, options.combinations) for images, shape_free in pairs]
    candidates = [one for one in candidates if one.lit]
    if not candidates:
        dark = _without_lights(problem, meter)
        return replace(dark, findings=(*dark.findings, NoOpening())) if spec.kinds[-1].distant else dark
    refiner = Refiner.of(problem.coarsest(blocks), meter, options.limits)
    found = _search(refiner, candidates, options, spec)
    # Which of those that blocks do not tell apart is the answer, pixels say.
    polished, (best, *others) = polished_on_pixels(refiner, problem, [found.best, *found.others], options)
    if not bool((best.intensity[: len(best.emitters)] > 0).any()):
        return _without_lights(polished.problem, meter)
    findings = found.findings
    if options.bar.unnoticed(polished.unexplained(best)):
        # What blocks miss there is what they do not see: shadows' edges.
        findings = [one for one in findings if not isinstance(one, LightMissing)]
    if spec.count is not None and not any(isinstance(finding, LightSpare) for finding in findings):
        findings = (*findings, *faded_light(refiner, best, options))
    if spec.ambient:
        findings = (*findings, *ambient_found(polished.problem, best, options.bar))
    else:
        findings = (*findings, *ambient_missing(refiner, candidates, found.best, findings, options))
    return _result(polished, best, findings, Costs.of(refiner, found.compared), options, others, found.weighed)


def fit_from(
    problem: LightProblem, start: Sequence[Emitter], iterations: int = 30, options: SearchOptions | None = None
) -> FitResult:
    """Lights from known starts, by plain least squares: no search, no robust loss."""
    options = options or SearchOptions()
    if problem.black:
        return dark_result(0.0)
    size = weight(start)
    with Course.shown((POLISH + BRIGHT_SPOTS) * size) as course:
        refiner = Refiner.of(problem.sharpest(), Meter(course=course))
        with course.polishing(size, 1):
            best = refiner.refined(refiner.start(start, PLAIN), PLAIN, iterations)
        if best.status is FitStatus.CONVERGED:
            with course.part("bright spots", BRIGHT_SPOTS * size):
                refiner, (best,) = seen_well(refiner, [best], options)
        return _result(refiner, best, (), Costs({}), options)


@dataclass(frozen=True)
class _Searched:
    """What a search ends with.

    Attributes:
        best: the rig that was chosen.
        findings: what was found out on the way.
        compared: by number of lights the rigs that were compared.
        others: rigs that explain about as much, as far as blocks tell.
        weighed: those that blocks rule out.
    """

    best: State
    findings: tuple[Finding, ...]
    compared: Mapping[int, State]
    others: tuple[State, ...]
    weighed: Sequence[Alternative]


def _search(refiner: Refiner, candidates: Sequence[Candidates], options: SearchOptions, spec: LightSpec) -> _Searched:
    """Search, then doubt what was found."""
    search = RigSearch(refiner, candidates, options, kinds_open=len(spec.kinds) > 1)
    found = search.unknown() if spec.count is None else search.known(spec.count)
    found = grown(refiner, found, spec, options) if spec.extended or spec.mounted else found
    best, kinds, course = found.best, (), refiner.meter.course
    size = weight(best.emitters)
    course.further(effort_after(size) - effort_after((spec.count or 1) ** GROWTH))
    with course.part("kinds of lights", KINDS * size, len(best.emitters)):
        if spec.type == AUTO:
            best, kinds, tables = told_kinds(refiner, candidates, best, spec, options)
        else:
            best, tables = told_tables(refiner, best, spec, options)
    with course.part("looking beside", BLOCKS_BESIDE * size, 2 * steps_aside(options)):
        best, beside = settled_beside(refiner, best, options)
    if best is not found.best:
        found = replace(found, best=best, compared={**found.compared, len(best.emitters): best})
    rival = rival_among(refiner, best, found.others, options)
    # Blocks err at shadows' edges: what leaves about as little there is left to the pixels.
    others = [other for other in (*tables, *beside) if leaves_as_little(refiner, best, other, options.rivals)]
    others += [] if rival is None else [rival]
    doubted = Doubted()
    if spec.count is not None:
        doubted = doubted_number(refiner, candidates, found.best, spec.count, options)
    compared = {**found.compared, **doubted.compared}
    findings = (*doubted.findings, *kinds)
    if not any(isinstance(finding, LightMissing) for finding in findings):
        costs = Costs.of(refiner, compared)
        findings = (*findings, *costs.maybe_more(len(found.best.emitters), compared, options.bar))
    told = weighed(refiner, best, [*found.others, *tables, *beside, *compared.values()], findings, options)
    # What leaves about as little was looked at again: it is another answer on all pixels, or none.
    told = [one for one in told if one.more or one.ruled_out]
    return _Searched(best, findings, compared, tuple(others), told)


def _roughly_exposed(problem: LightProblem, coarse: Sequence[CoarseImages]) -> LightProblem:
    """The problem with free exposures near those of the single candidate that explains most, for the search."""
    if not problem.exposure_free or not len(coarse[0]):
        return problem
    images = coarse[0]
    seen = torch.cat([images.images, *((images.blocks @ one.image)[None] for one in problem.known)])
    target = images.blocks @ problem.target
    weights = problem.block_weights(target, images.counts.to(target), images.blocks)
    views = view_of_blocks(images.blocks, problem.views)
    return problem.with_exposures(rough_exposures(seen, target, weights, views, len(problem.exposures)))


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
    findings = (*(told_rival(refiner, best, other) for other in rivals), *findings, *open_tables)
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
        **_strengths(problem, best, spread.known),
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
    strengths = _strengths(problem, state, spreads)
    told = [MuchAmbient(strengths["ambient"].share)] if "ambient" in strengths else []
    loss = problem.unexplained(columns, found.intensity)
    return replace(result, findings=(*result.findings, *told), loss=loss, **strengths)


def _strengths(problem: LightProblem, best: State, covariance: Sequence[Tensor]) -> dict[str, Strength]:
    """How strong known images are, by the fields of a result."""
    count, energies = len(best.emitters), column_energies(best)
    parts = zip(problem.known, best.intensity[count:], covariance, energies[count:], strict=True)
    return {
        FIELDS[one.name]: Strength(one.unit * value, spread, energy / max(sum(energies), 1e-300))
        for one, value, spread, energy in parts
    }
