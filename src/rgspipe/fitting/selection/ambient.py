"""What is to be said of light from all around: how much there is, that none arrives, that some is missing, or that
nobody can tell."""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.fitting.findings import AmbientOpen, Finding, LightMissing, MaybeAmbient, MuchAmbient, NoOpening
from rgspipe.fitting.model.known_images import KnownImage, Strength
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import BarOptions, SearchOptions
from rgspipe.fitting.search.compare import best_state, column_energies, drop
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import refined_starts
from rgspipe.fitting.search.starts import Candidates
from rgspipe.renderer.ambient import rough_ambient_radiance

#: Standard deviations within which light from all around may be anything: as strong as all that views show, or none.
DEVIATIONS = 2.0


def ambient_open(ambient: Strength, shown: float) -> list[Finding]:
    """Whether views tell that there is light from all around, or that there is none.

    Args:
        ambient: as it was found.
        shown: mean radiance of the views.
    """
    deviation = DEVIATIONS * float(ambient.covariance.diagonal().mean().sqrt())
    told = deviation <= max(float(ambient.value.mean()), shown)
    return [] if told else [AmbientOpen(deviation / DEVIATIONS / shown)]


def ambient_found(problem: LightProblem, best: State, bar: BarOptions) -> list[Finding]:
    """What an answer says of light from all around that was allowed for."""
    names = [image.name for image in problem.known]
    if "ambient" not in names:
        return [NoOpening()]
    energies = column_energies(best)
    share = energies[len(best.emitters) + names.index("ambient")] / max(sum(energies), 1e-300)
    return [MuchAmbient(share)] if share >= bar.faint else []


def ambient_missing(
    refiner: Refiner,
    candidates: Sequence[Candidates],
    best: State,
    findings: Sequence[Finding],
    options: SearchOptions,
) -> list[Finding]:
    """Whether some light from all around, which was not allowed for, would leave clearly less of the target.

    Asked of answers that explain too little as they are: from where their lights are, and from the candidates that
    look best beside such light, with what the scene's operators know of its openings.

    Args:
        refiner: on the problem that the answer was searched on.
        candidates: of each kind of light.
        best: the answer.
        findings: what else was found out about it.
    """
    poor = refiner.unexplained(best) > options.certainty.poorly
    if not poor and not any(isinstance(finding, LightMissing) for finding in findings):
        return []
    problem = refiner.problem
    frozen, average = problem.views.frozen, problem.model.average
    radiance = rough_ambient_radiance(frozen, problem.model.effects.interreflection)
    if radiance is None:
        return []
    known = KnownImage("ambient", problem.views.operator @ radiance, problem.scale)
    beside = refiner.on(problem.with_known(known if average is None else known.averaged(average)))
    rigs, lights, tries = [best.emitters], len(best.emitters), max(1, options.starts // 2)
    for kind in candidates:
        lit = Candidates.of(kind.problem.with_known(known), kind.coarse, kind.shape_free, kind.options)
        rigs += lit.rigs(lights, tries, refiner.region.size) if lit.lit else []
    rich = best_state(beside.problem, refined_starts(beside, rigs, options.iterations, options.schedule))
    gain = drop(beside.problem, best, rich)
    return [MaybeAmbient(gain)] if gain >= options.bar.least_faint else []
