"""What a search found out is told in full, the gravest first."""

from __future__ import annotations

import json
from collections.abc import Sequence
from operator import attrgetter

import pytest

from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.findings import (
    AtBound,
    BehindSurfaces,
    Finding,
    FitStatus,
    LightMissing,
    LightSpare,
    MaybeOneMore,
    OnSurface,
    OutOfSteps,
    PoorlyExplained,
    PoorScene,
    Rival,
    RoughShape,
    ScaleOpen,
    Uncertain,
    Undetermined,
    gravest,
)
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.words import MEANINGS, explained, told_alternative, told_costs
from rgspipe.scene import PointLight

DOUBT = Undetermined(1, 1, ("intensity",))
BAR = ("bar.least",)
DOUBTED = "Not determined by these views: intensity."


def test_without_a_finding_a_fit_has_converged() -> None:
    assert gravest(()) is FitStatus.CONVERGED and explained(()) == MEANINGS[FitStatus.CONVERGED]


def test_a_doubt_is_not_hidden_by_steps_that_ran_out() -> None:
    found = (OutOfSteps(), DOUBT)
    assert gravest(found) is FitStatus.UNDETERMINED and gravest(found[:1]) is FitStatus.MAX_ITERATIONS
    assert DOUBTED in explained(found) and MEANINGS[FitStatus.MAX_ITERATIONS] in explained(found)


@pytest.mark.parametrize(
    ("found", "status"),
    [
        ((DOUBT, Rival(0.2), PoorlyExplained(0.3), AtBound()), FitStatus.AT_BOUND),
        ((DOUBT, PoorlyExplained(0.3), Rival(0.2)), FitStatus.UNEXPLAINED),
        ((DOUBT, Rival(0.2)), FitStatus.AMBIGUOUS),
        ((DOUBT,), FitStatus.UNDETERMINED),
    ],
)
def test_the_gravest_finding_is_the_status_and_all_are_told(found: Sequence[Finding], status: FitStatus) -> None:
    assert gravest(found) is status
    words = explained(found)
    assert words.startswith(MEANINGS[status]) and DOUBTED in words and MEANINGS[FitStatus.CONVERGED] not in words
    assert (MEANINGS[FitStatus.AMBIGUOUS] in words) == (Rival(0.2) in found)


def test_a_number_that_is_too_small_is_told_with_the_next_one() -> None:
    words = explained([LightMissing(1, 0.62, decided_by=BAR)])
    assert gravest([LightMissing(1, 0.62, decided_by=BAR)]) is FitStatus.UNEXPLAINED
    assert "62 %" in words and "LightSpec(count=2)" in words and "LightSpec(count=None)" in words
    assert (
        "count=4" in explained([LightMissing(3, 0.62, decided_by=BAR)]) and MEANINGS[FitStatus.UNEXPLAINED] not in words
    )


def test_what_is_left_unexplained_is_told_beside_a_light_that_is_missing() -> None:
    words = explained([PoorlyExplained(0.1), LightMissing(1, 0.62, decided_by=BAR)])
    assert words.startswith(MEANINGS[FitStatus.UNEXPLAINED]) and "count=2" in words


def test_a_number_that_is_too_large_is_told_with_the_light_that_may_not_be_there() -> None:
    found = [LightSpare(3, 3, 0.04, 0.2, decided_by=BAR)]
    words = explained(found)
    assert gravest(found) is FitStatus.AMBIGUOUS and MEANINGS[FitStatus.AMBIGUOUS] not in words
    assert words.startswith("Light 3 lowers the cost by 4 % only") and "from 20 % on" in words
    assert "LightSpec(count=2)" in words and "LightSpec(count=None)" in words


def test_other_lights_that_explain_as_much_are_told_beside_a_light_too_many() -> None:
    words = explained([Rival(0.2), LightSpare(2, 2, 0.04, 0.2, decided_by=BAR), DOUBT])
    assert words.startswith(MEANINGS[FitStatus.AMBIGUOUS]) and "Light 2" in words and DOUBTED in words


def test_a_rival_is_told_with_how_far_it_is() -> None:
    assert "stands 20 % of the scene's size away" in explained([Rival(0.2)])
    assert "more, or fewer" in explained([Rival(None)]) and "nan" not in json.dumps(Rival(None).data())
    assert Rival(0.25).data().items() >= {"finding": "rival", "distance": 0.25}.items()


def test_lights_are_numbered_where_there_are_several() -> None:
    assert "the position by 30 %" in explained([Uncertain(1, 1, 0.3)])
    assert "the position of light 2 by 15 %" in explained([Uncertain(2, 2, 0.15)])
    assert "The light stands on a surface" in explained([OnSurface(1, 1)])
    assert "Light 3 stands on a surface" in explained([OnSurface(1, 3), OnSurface(3, 3)])
    assert "Light 2 stands behind surfaces or inside" in explained([BehindSurfaces(2, 2, 0.002)])
    assert "0.2 % of what one in the open would send" in explained([BehindSurfaces(1, 1, 0.002)])
    rough = RoughShape(1, 2, ("width", "turn"), (0.24, 3.0))
    assert "Hardly determined by these views: width (by 24 %) and turn (by 100 %) of light 1." in explained([rough])
    assert "axis and cone of light 2" in explained([Undetermined(2, 2, ("direction", "cone_angle"))])


def test_what_may_be_there_leaves_the_answer_as_it_is() -> None:
    found = [MaybeOneMore(0.1, 0.2, decided_by=BAR)]
    assert gravest(found) is FitStatus.CONVERGED
    assert explained(found).startswith(MEANINGS[FitStatus.CONVERGED]) and "may be one" in explained(found)


def test_findings_are_data() -> None:
    fields = json.loads(json.dumps([LightSpare(3, 3, 0.04, 0.2, decided_by=BAR).data(), DOUBT.data()]))
    numbers = {"number": 3, "count": 3, "gain": 0.04, "wanted": 0.2}
    assert fields[0] == {"finding": "light_spare", **numbers, "decided_by": ["bar.least"]}
    assert fields[1] == {"finding": "undetermined", "number": 1, "count": 1, "fields": ["intensity"]}


def test_a_poor_scene_is_no_place_for_an_answer_that_is_sure() -> None:
    assert gravest([PoorScene(0.05)]) is FitStatus.UNDETERMINED
    assert "The scene is poor: lights in it are expected to be off by 5 % of its size." in explained([PoorScene(0.05)])


def test_a_scale_that_photographs_left_open_is_told_beside_a_sure_answer() -> None:
    assert gravest([ScaleOpen(0.21)]) is FitStatus.CONVERGED
    told = explained([ScaleOpen(0.21)])
    assert told.startswith(MEANINGS[FitStatus.CONVERGED]) and "to 21 % only: all intensities may be off" in told


def test_a_finding_names_the_settings_that_decided() -> None:
    assert explained([LightSpare(2, 2, 0.24, 0.5, decided_by=("bar.least_faint",))]).endswith(
        "Decided by Search.bar.least_faint."
    )
    assert "Decided by Search.certainty.doubtful." in explained([Uncertain(1, 1, 0.3)])
    rivals = "Search.rivals.deviations, Search.rivals.energy and Search.certainty.doubtful."
    assert explained([Rival(0.2)]).endswith(f"Decided by {rivals}")
    assert "Decided" not in explained([DOUBT])


def test_what_decides_are_numbers_of_the_search() -> None:
    named = {name for kind in Finding.__subclasses__() for name in kind.__dict__.get("decided_by", ())}
    options = SearchOptions()
    for name in named:
        assert isinstance(attrgetter(name)(options), float | int), name
    assert len(named) >= 7


@pytest.mark.parametrize(
    ("count", "cost", "left", "more", "ruled_out", "told"),
    [
        (1, 1.5, 3.24, 0, True, "3.2 times as much unexplained."),
        (1, 1.5, 1.1, 0, True, "1.5 times the cost."),
        (1, 1.0, 1.1, 0, False, "Explains the target as well: another answer."),
        (2, 0.96, 0.9, 1, True, "2 lights lower the cost by 4 %, too little to count."),
        (2, 1.2, 0.9, 1, True, "2 lights do not lower the cost."),
        (4, 0.68, 7.48, 1, True, "4 lights: 7.5 times as much unexplained."),
        (2, 0.89, 19.8, -1, True, "2 lights: 20 times as much unexplained."),
        (2, 0.2, 0.1, 1, False, "2 lights lower the cost by 80 %."),
        (1, 12345.0, 1e9, -1, True, "1 light: more than 10000 times the cost."),
        (2, 1.1, 1.2, -1, False, "2 lights: 1.1 times the cost, too little to rule them out."),
    ],
)
def test_what_speaks_against_an_alternative_is_a_sentence(count, cost, left, more, ruled_out, told) -> None:
    rig = (PointLight([0.0, 0.0, 0.0], 1.0),) * count
    assert told_alternative(Alternative(rig, cost, left, more, ruled_out)) == told


@pytest.mark.parametrize(
    ("costs", "told"),
    [
        ({}, ""),
        ({2: 0.3}, ""),
        ({2: 0.02, 1: 0.2}, "Of what 1 light leaves unexplained, 2 leave 10 %."),
        ({2: 0.4, 3: 0.392, 4: 0.6}, "Of what 2 lights leave unexplained, 3 leave 98 %, 4 leave 150 %."),
        ({1: 0.0, 2: 0.0}, "Of what 1 light leaves unexplained, 2 leave all of it."),
    ],
)
def test_what_numbers_of_lights_leave_is_told_in_per_cent(costs, told) -> None:
    assert told_costs(costs) == told
