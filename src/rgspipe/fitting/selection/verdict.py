"""What a search found out about its answer, as a status and in words: the gravest first, and no doubt left out."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.fitting.result import REASONS, FitStatus
from rgspipe.fitting.search.judge import FAINT, FAINT_DROP, LEAST_DROP

#: An answer that leaves more than this share of the target's energy unexplained is none.
POORLY_EXPLAINED = 0.05


@dataclass(frozen=True)
class SpareLight:
    """A light that may not be there.

    Attributes:
        number: which, from 1.
        gain: by what share it lowers the robust cost.
    """

    number: int
    gain: float


@dataclass(frozen=True)
class Findings:
    """What is known of an answer.

    Attributes:
        at_bound: whether a light stands on the edge of the region.
        loss: share of the target's energy that is left.
        too_few: by what share one light more lowers the robust cost, where it is worth that; else 0.
        spare: a light without which the others explain nearly as much; None if there is none.
        ambiguous: whether clearly different lights explain the target as well.
        doubt: what the views do not tell, in words; empty if nothing.
        ended: whether the refinement ended in a minimum (CONVERGED) or before (MAX_ITERATIONS).
    """

    at_bound: bool = False
    loss: float = 0.0
    too_few: float = 0.0
    spare: SpareLight | None = None
    ambiguous: bool = False
    doubt: str = ""
    ended: FitStatus = FitStatus.CONVERGED

    @property
    def statuses(self) -> list[FitStatus]:
        """All that hold, the gravest first."""
        held = {
            FitStatus.AT_BOUND: self.at_bound,
            FitStatus.UNEXPLAINED: self.loss > POORLY_EXPLAINED or self.too_few > 0.0,
            FitStatus.AMBIGUOUS: self.ambiguous or self.spare is not None,
            FitStatus.UNDETERMINED: bool(self.doubt),
            FitStatus.MAX_ITERATIONS: self.ended == FitStatus.MAX_ITERATIONS,
        }
        return [status for status, holds in held.items() if holds] or [FitStatus.CONVERGED]

    @property
    def status(self) -> FitStatus:
        """The gravest."""
        return self.statuses[0]

    def reason(self, lights: int) -> str:
        """All that holds, in words, of an answer of so many lights."""
        return " ".join(filter(None, (self._sentence(status, lights) for status in self.statuses)))

    def _sentence(self, status: FitStatus, lights: int) -> str:
        if status == FitStatus.UNDETERMINED:
            # What is in doubt says enough beside another status.
            return f"{REASONS[status]} {self.doubt}" if status == self.status else self.doubt
        if status == FitStatus.UNEXPLAINED and self.too_few:
            return _with(self.loss > POORLY_EXPLAINED, status, self._one_more(lights))
        if status == FitStatus.AMBIGUOUS and self.spare:
            return _with(self.ambiguous, status, self._one_less(lights))
        return REASONS[status]

    def _one_more(self, lights: int) -> str:
        more = f"One more light would lower the cost by {percent(self.too_few)}: fit with light.count={lights + 1}, or "
        return f"{more}light.count=null to have them counted."

    def _one_less(self, lights: int) -> str:
        less = f"Light {self.spare.number} lowers the cost by {percent(self.spare.gain)} only and may not be there "
        less += f"(it counts {counted_from()}): fit with light.count={lights - 1}, or "
        return f"{less}light.count=null to have them counted."


def _with(also: bool, status: FitStatus, sentence: str) -> str:
    """The sentence, after that of the status where this holds as well."""
    return f"{REASONS[status]} {sentence}" if also else sentence


def counted_from() -> str:
    """From where on a light more is taken for one that is there."""
    limits = f"from {percent(LEAST_DROP)} on, of a light with less than {percent(FAINT)} of the energy from "
    return f"{limits}{percent(FAINT_DROP)} on"


def percent(share: float) -> str:
    """A share in words."""
    return f"{100.0 * share:.0f} %"
