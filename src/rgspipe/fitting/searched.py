"""A target that was searched on blocks of pixels: the answers that they leave, of which pixels choose.

Whoever doubts what was searched, as lamps may be in sight, looks at a rough answer first (`Searched.roughly`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.course import BEGINNING, BLOCKS_BESIDE, GROWTH, KINDS, effort_after, weight
from rgspipe.fitting.findings import Finding, LightMissing
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.exposure import rough_exposures
from rgspipe.fitting.model.known_images import FIELDS, Strength
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.result import FitResult, dark_result
from rgspipe.fitting.search.beside import settled_beside, steps_aside
from rgspipe.fitting.search.coarse import CoarseImages
from rgspipe.fitting.search.compare import column_energies
from rgspipe.fitting.search.grow import grown
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.rig_search import RigSearch
from rgspipe.fitting.search.starts import Candidates
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.alternatives import weighed
from rgspipe.fitting.selection.diagnosis import Costs
from rgspipe.fitting.selection.kinds import told_kinds
from rgspipe.fitting.selection.number import Doubted, doubted_number
from rgspipe.fitting.selection.rivals import leaves_as_little, rival_among
from rgspipe.fitting.selection.tables import told_tables
from rgspipe.fitting.spec import AUTO, LightSpec
from rgspipe.renderer.images.blocks import view_of_blocks
from rgspipe.renderer.images.model import ImageModel


@dataclass(frozen=True)
class Searched:
    """What a search ends with.

    Attributes:
        problem: of all pixels that the search was about.
        candidates: of each kind of light that was looked for.
        refiner: of its blocks.
        best: the rig that was chosen.
        findings: what was found out on the way.
        compared: by number of lights the rigs that were compared.
        others: rigs that explain about as much, as far as blocks tell.
        weighed: those that blocks rule out.
    """

    problem: LightProblem
    candidates: Sequence[Candidates]
    refiner: Refiner
    best: State
    findings: tuple[Finding, ...]
    compared: Mapping[int, State]
    others: tuple[State, ...]
    weighed: Sequence[Alternative]

    @property
    def unexplained(self) -> float:
        """`LightProblem.unexplained` of blocks."""
        return self.refiner.unexplained(self.best)

    def on(self, problem: LightProblem) -> tuple[LightProblem, list[State]]:
        """The rigs of which pixels choose, the best first, as another problem of the same images has them.

        Returns:
            the problem, with exposures as far as the search found them; and the rigs.
        """
        scale = self.problem.scale / problem.scale
        units = [own.unit / other.unit for own, other in zip(self.problem.known, problem.known, strict=True)]

        def scaled(state: State) -> State:
            factors = state.intensity.new_tensor([*[scale] * len(state.emitters), *units])
            return replace(state, intensity=state.intensity * factors[:, None])

        if problem.exposure_free:
            problem = problem.with_exposures(self.problem.exposures)
        return problem, [scaled(state) for state in (self.best, *self.others)]

    def roughly(self) -> FitResult:
        """The answer of blocks: lights, exposures and known images, none of them with an uncertainty."""
        problem, best = self.refiner.problem, self.best
        exposures = problem.exposures
        if problem.exposure_free:
            found = problem.moments(best.columns, PLAIN.at(problem, best.columns, best.intensity))
            exposures = problem.with_exposures(found.exposures).exposures
        open_ = [torch.zeros((3, 3), dtype=torch.float64) for _ in problem.known]
        return replace(
            dark_result(self.refiner.meter.seconds),
            findings=self.findings,
            lights=best.lights(problem),
            exposures=tuple(exposures.tolist()),
            **strengths(problem, best, open_),
        )


def searched(
    problem: LightProblem,
    coarse: Sequence[CoarseImages],
    options: SearchOptions,
    spec: LightSpec,
    blocks: ImageModel | None,
    meter: Meter,
) -> Searched | None:
    """Search a target that is not black; None where no candidate lights any of it.

    Args:
        coarse: the candidates' images, of the plainest kind of light first where there are several.
        blocks: the views as blocks of pixels, on which starts are refined; on all pixels if None.
    """
    problem = _roughly_exposed(problem, coarse)
    free = [spec.seed.free(images.shapes[0]) for images in coarse]
    pairs = zip(coarse, free, strict=True)
    with meter.course.part("looking at candidates", BEGINNING):
        candidates = [Candidates.of(problem, images, shape_free, options.combinations) for images, shape_free in pairs]
    candidates = [one for one in candidates if one.lit]
    if not candidates:
        return None
    return _doubted(problem, candidates, Refiner.of(problem.coarsest(blocks), meter, options.limits), options, spec)


def _doubted(
    problem: LightProblem, candidates: Sequence[Candidates], refiner: Refiner, options: SearchOptions, spec: LightSpec
) -> Searched:
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
    return Searched(problem, candidates, refiner, best, findings, compared, tuple(others), told)


def strengths(problem: LightProblem, best: State, covariance: Sequence[Tensor]) -> dict[str, Strength]:
    """How strong known images are, by the fields of a result."""
    count, energies = len(best.emitters), column_energies(best)
    parts = zip(problem.known, best.intensity[count:], covariance, energies[count:], strict=True)
    return {
        FIELDS[one.name]: Strength(one.unit * value, spread, energy / max(sum(energies), 1e-300))
        for one, value, spread, energy in parts
    }


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
