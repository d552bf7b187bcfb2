"""What a search found out is told in full, the gravest first."""

from __future__ import annotations

import pytest

from rgspipe.fitting import FitStatus
from rgspipe.fitting.result import REASONS
from rgspipe.fitting.selection.verdict import POORLY_EXPLAINED, Findings, SpareLight

DOUBT = "These views do not determine the intensity."


def test_without_a_finding_a_fit_has_converged() -> None:
    assert Findings().status is FitStatus.CONVERGED and Findings().reason(1) == REASONS[FitStatus.CONVERGED]


def test_a_doubt_is_not_hidden_by_steps_that_ran_out() -> None:
    found = Findings(doubt=DOUBT, ended=FitStatus.MAX_ITERATIONS)
    assert found.status is FitStatus.UNDETERMINED
    assert DOUBT in found.reason(1) and REASONS[FitStatus.MAX_ITERATIONS] in found.reason(1)
    assert Findings(ended=FitStatus.MAX_ITERATIONS).status is FitStatus.MAX_ITERATIONS


@pytest.mark.parametrize(
    ("found", "status"),
    [
        (Findings(at_bound=True, loss=0.3, ambiguous=True, doubt=DOUBT), FitStatus.AT_BOUND),
        (Findings(loss=0.3, ambiguous=True, doubt=DOUBT), FitStatus.UNEXPLAINED),
        (Findings(ambiguous=True, doubt=DOUBT), FitStatus.AMBIGUOUS),
        (Findings(doubt=DOUBT), FitStatus.UNDETERMINED),
    ],
)
def test_the_gravest_finding_is_the_status_and_all_are_told(found: Findings, status: FitStatus) -> None:
    assert found.status is status
    reason = found.reason(1)
    assert reason.startswith(REASONS[status]) and DOUBT in reason and REASONS[FitStatus.CONVERGED] not in reason
    assert (REASONS[FitStatus.AMBIGUOUS] in reason) == found.ambiguous


def test_a_number_that_is_too_small_is_told_with_the_next_one() -> None:
    found = Findings(loss=0.01, too_few=0.62)
    assert found.status is FitStatus.UNEXPLAINED
    assert "62 %" in found.reason(1) and "light.count=2" in found.reason(1) and "light.count=null" in found.reason(1)
    assert "light.count=4" in found.reason(3) and REASONS[FitStatus.UNEXPLAINED] not in found.reason(1)


def test_what_is_left_unexplained_is_told_beside_a_light_that_is_missing() -> None:
    reason = Findings(loss=2.0 * POORLY_EXPLAINED, too_few=0.62).reason(1)
    assert REASONS[FitStatus.UNEXPLAINED] in reason and "light.count=2" in reason


def test_a_number_that_is_too_large_is_told_with_the_light_that_may_not_be_there() -> None:
    found = Findings(spare=SpareLight(number=3, gain=0.04))
    assert found.status is FitStatus.AMBIGUOUS
    reason = found.reason(3)
    assert reason.startswith("Light 3 lowers the cost by 4 % only") and REASONS[FitStatus.AMBIGUOUS] not in reason
    assert "light.count=2" in reason and "light.count=null" in reason and "from 20 % on" in reason


def test_other_lights_that_explain_as_much_are_told_beside_a_light_too_many() -> None:
    reason = Findings(ambiguous=True, spare=SpareLight(2, 0.04), doubt=DOUBT).reason(2)
    assert reason.startswith(REASONS[FitStatus.AMBIGUOUS]) and "Light 2" in reason and DOUBT in reason
