"""What is to be said of lights that were fitted, whoever fitted them: where they stand and what they leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from torch import Tensor

from rgspipe.fitting.certainty.doubts import doubts
from rgspipe.fitting.findings import (
    AtBound,
    Finding,
    FitStatus,
    Hangs,
    MaybeOneMore,
    OutOfSteps,
    PoorlyExplained,
    PoorScene,
    ScaleOpen,
)
from rgspipe.fitting.options import BarOptions, CertaintyOptions
from rgspipe.fitting.search.compare import robust_costs, wanted
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.scene.grade import TIED, Grade


def standing(
    refiner: Refiner, state: State, covariance: Sequence[Tensor], options: CertaintyOptions | None = None
) -> list[Finding]:
    """What holds of lights by themselves, without a rival.

    Args:
        refiner: on the problem of all pixels that they were fitted to.
        covariance: of each, see `FitResult.covariance`.
    """
    options = options or CertaintyOptions()
    problem, region = refiner.problem, refiner.region
    loss = problem.unexplained_of_lights(state.columns, state.intensity)
    grade = problem.views.frozen.grade
    at_bound = any(region.at_bound(one.position) for one in state.emitters if not one.light.distant)
    return [
        *([AtBound()] if at_bound else []),
        *([PoorlyExplained(loss)] if loss > options.poorly else []),
        *([PoorScene(grade.error)] if grade is not None and grade.grade is Grade.POOR else []),
        *doubts(state.lights(problem), covariance, problem.views.frozen.bvh.surfels, region.size, options),
        *([ScaleOpen(grade.scale)] if grade is not None and grade.scale > TIED else []),
        *([OutOfSteps()] if state.status is FitStatus.MAX_ITERATIONS else []),
    ]


def hanging(state: State) -> list[Finding]:
    """How far lights hang from their surfaces, where that was found."""
    pairs = enumerate((emitter.mount, emitter.position) for emitter in state.emitters)
    count = len(state.emitters)
    return [
        Hangs(index + 1, count, mount.before(place))
        for index, (mount, place) in pairs
        if mount is not None and mount.distance is None
    ]


@dataclass(frozen=True)
class Costs:
    """Robust costs of rigs that were compared, at one scale.

    Attributes:
        by_count: by number of lights.
    """

    by_count: Mapping[int, float]

    @classmethod
    def of(cls, refiner: Refiner, compared: Mapping[int, State]) -> Costs:
        """Those of `compared` rigs by their number of lights."""
        costs = robust_costs(refiner.problem, [*compared.values()]) if compared else []
        return cls(dict(zip(compared, costs, strict=True)))

    def maybe_more(self, count: int, compared: Mapping[int, State], bar: BarOptions) -> list[Finding]:
        """Whether one light more than `count` might be there, though it lowers the cost too little to count."""
        costs = self.by_count
        if count not in costs or count + 1 not in costs:
            return []
        gain = 1.0 - costs[count + 1] / costs[count]
        if gain <= bar.doubtful:
            return []
        needed = wanted(compared[count + 1], bar)
        return [MaybeOneMore(gain, needed.share, decided_by=(needed.setting, "bar.doubtful"))]
