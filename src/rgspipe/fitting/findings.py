"""What a fit found out about its answer, as data; `words` makes sentences of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import ClassVar


class FitStatus(StrEnum):
    """What is to be thought of an answer, the gravest first."""

    NOT_ENOUGH_LIGHT = "not_enough_light"
    AT_BOUND = "at_bound"
    UNEXPLAINED = "unexplained"
    AMBIGUOUS = "ambiguous"
    UNDETERMINED = "undetermined"
    MAX_ITERATIONS = "max_iterations"
    CONVERGED = "converged"


@dataclass(frozen=True)
class Finding:
    """One thing that holds of an answer."""

    #: What an answer is of which nothing graver holds.
    status: ClassVar[FitStatus]
    #: The numbers of `SearchOptions` that decided that it holds, by their places there.
    decided_by: ClassVar[tuple[str, ...]] = ()

    def data(self) -> dict[str, object]:
        """Its name and numbers, and what decided, as JSON holds them."""
        name = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in type(self).__name__)
        decided = {"decided_by": list(self.decided_by)} if self.decided_by else {}
        return {"finding": name.lstrip("_"), **asdict(self), **decided}


@dataclass(frozen=True)
class Dark(Finding):
    """The target is black, or no light can explain it."""

    status = FitStatus.NOT_ENOUGH_LIGHT


@dataclass(frozen=True)
class AtBound(Finding):
    """A light was stopped at the edge of the region that is searched."""

    status = FitStatus.AT_BOUND


@dataclass(frozen=True)
class PoorlyExplained(Finding):
    """`share` of the target's energy is left."""

    share: float
    status = FitStatus.UNEXPLAINED
    decided_by = ("certainty.poorly",)


@dataclass(frozen=True)
class LightMissing(Finding):
    """One light more than the `count` that were asked for lowers the robust cost by the share `gain`: it is there."""

    count: int
    gain: float
    decided_by: tuple[str, ...] = field(kw_only=True)
    status = FitStatus.UNEXPLAINED


@dataclass(frozen=True)
class LampElsewhere(Finding):
    """View `view` (from 0) shows a lamp at `column` and `row` [pixels], and no light was found where it may stand."""

    view: int
    column: float
    row: float
    status = FitStatus.UNEXPLAINED


@dataclass(frozen=True)
class Rival(Finding):
    """Clearly different lights explain the target as well.

    A light is `distance`, a part of the scene's size, away from its counterpart; None where they are not as many.
    """

    distance: float | None
    status = FitStatus.AMBIGUOUS
    decided_by = ("rivals.deviations", "rivals.energy", "certainty.doubtful")


@dataclass(frozen=True)
class LightSpare(Finding):
    """Light `number` (from 1) of `count` may not be there.

    It lowers the robust cost by the share `gain`; from `wanted` on it would count.
    """

    number: int
    count: int
    gain: float
    wanted: float
    decided_by: tuple[str, ...] = field(kw_only=True)
    status = FitStatus.AMBIGUOUS


@dataclass(frozen=True)
class Undetermined(Finding):
    """The views do not tell some fields of light `number` (from 1) of `count`, by name ("intensity" among them)."""

    number: int
    count: int
    fields: tuple[str, ...]
    status = FitStatus.UNDETERMINED


@dataclass(frozen=True)
class RoughShape(Finding):
    """The views hardly tell some `fields` of the shape of light `number` (from 1) of `count`.

    Their standard deviations are the shares `errors` of them; of an angle, of that of one of which nothing is known.
    """

    number: int
    count: int
    fields: tuple[str, ...]
    errors: tuple[float, ...]
    status = FitStatus.UNDETERMINED


@dataclass(frozen=True)
class Uncertain(Finding):
    """Light `number` of `count` is expected to be off by `error`, a part of the scene's size; `distant` ones rad."""

    number: int
    count: int
    error: float
    distant: bool = False
    status = FitStatus.UNDETERMINED
    decided_by = ("certainty.doubtful",)


@dataclass(frozen=True)
class OnSurface(Finding):
    """Light `number` of `count` stands on a surface, where lights that belong elsewhere are stopped."""

    number: int
    count: int
    status = FitStatus.UNDETERMINED
    decided_by = ("certainty.on_surface",)


@dataclass(frozen=True)
class BehindSurfaces(Finding):
    """Surfaces get next to none of the light of light `number` of `count`: `share` of what one as far away may send."""

    number: int
    count: int
    share: float
    status = FitStatus.UNDETERMINED


@dataclass(frozen=True)
class PoorScene(Finding):
    """The scene itself was graded poor: its lights are expected to be off by `error`, a part of its size."""

    error: float
    status = FitStatus.UNDETERMINED


@dataclass(frozen=True)
class OutOfSteps(Finding):
    """All steps were used while the loss was still falling."""

    status = FitStatus.MAX_ITERATIONS
    decided_by = ("iterations",)


@dataclass(frozen=True)
class AllStepsTaken(Finding):
    """A method that takes all of its `steps`; over the last epoch the loss changed by the share `change`."""

    steps: int
    change: float
    status = FitStatus.MAX_ITERATIONS


@dataclass(frozen=True)
class MaybeOneMore(Finding):
    """One light more would lower the robust cost by the share `gain`, which is too little to count (`wanted`)."""

    gain: float
    wanted: float
    decided_by: tuple[str, ...] = field(kw_only=True)
    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class Hangs(Finding):
    """Light `number` (from 1) of `count`, known to hang on a surface, is `distance` scene units before it."""

    number: int
    count: int
    distance: float
    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class ExtentOpen(Finding):
    """Light `number` (from 1) of `count` is a point to these views, and may be a `kind` of up to `size` scene units."""

    number: int
    count: int
    kind: str
    size: float
    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class KindOpen(Finding):
    """Light `number` (from 1) of `count` explains the target as well as a light of another `kind`."""

    number: int
    count: int
    kind: str
    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class ExposureUnknown(Finding):
    """A single view cannot tell its exposure from the lights' intensity."""

    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class ScaleOpen(Finding):
    """Intensities are known up to a factor that all share, as the scene's albedo is: its logarithm to `error`.

    Standard deviations of intensities do not hold it.
    """

    error: float
    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class LampsLeftOut(Finding):
    """`count` times a lamp is in sight, in `views` of the views; its `pixels`, of all views, were left out."""

    count: int
    pixels: int
    views: int
    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class MuchAmbient(Finding):
    """Light from all around through openings is the share `share` of the image's light."""

    share: float
    status = FitStatus.CONVERGED
    decided_by = ("bar.faint",)


@dataclass(frozen=True)
class MaybeAmbient(Finding):
    """Light from all around, which was not allowed for, would lower the robust cost by the share `gain`."""

    gain: float
    status = FitStatus.CONVERGED
    decided_by = ("bar.least_faint",)


@dataclass(frozen=True)
class AmbientOpen(Finding):
    """Light from all around was allowed for, and the views do not tell whether there is any.

    Its radiance is uncertain by `error` times what they show on the average.
    """

    error: float
    status = FitStatus.CONVERGED


@dataclass(frozen=True)
class NoOpening(Finding):
    """Light from outside was allowed for, and the scene is closed: none arrives."""

    status = FitStatus.CONVERGED


def gravest(findings: Sequence[Finding]) -> FitStatus:
    """The status of an answer."""
    held = {finding.status for finding in findings}
    return next((status for status in FitStatus if status in held), FitStatus.CONVERGED)
