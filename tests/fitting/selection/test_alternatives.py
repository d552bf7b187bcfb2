"""What an answer was weighed against is told, with what speaks against it."""

from __future__ import annotations

import torch

from emitters import placed, refiner_of
from lit_room import VISIBLE
from rgspipe.fitting import LightSpec, fit_lights
from rgspipe.fitting.findings import LightMissing, LightSpare, Rival
from rgspipe.fitting.options import RivalOptions, SearchOptions
from rgspipe.fitting.search.compare import robust_costs
from rgspipe.fitting.selection.alternatives import still_apart, weighed

OPTIONS = SearchOptions()
BAR = ("bar.least",)


def test_lights_elsewhere_are_told_once_and_by_how_much_worse_they_are(room, point_light) -> None:
    refiner = refiner_of(room, point_light)
    answer, near, far, again = (placed(refiner, by) for by in (0.001, 0.002, 0.15, 0.151))
    [one] = weighed(refiner, answer, [near, again, far, answer], (), OPTIONS)
    assert torch.allclose(one.lights[0].position, torch.tensor(VISIBLE).double() + 0.15)
    # A light off by 0.15 leaves a thousand times what one off by 0.001 does, and more.
    assert one.ruled_out and one.more == 0 and one.left > 1000 and one.cost > 1
    assert one.left == refiner.unexplained(far) / refiner.unexplained(answer)


def test_costs_are_over_the_least_where_the_answer_stands(room, point_light) -> None:
    """What was refined robustly there may have a lower one than an answer by squares."""
    refiner = refiner_of(room, point_light)
    answer, better, far = (placed(refiner, by) for by in (0.01, 0.001, 0.15))
    [one], [alone] = (weighed(refiner, answer, others, (), OPTIONS) for others in ([better, far], [far]))
    least, cost = robust_costs(refiner.problem, [better, far])
    assert one.cost == cost / least > 2.0 * alone.cost  # measured 24.7 and 11.5


def test_what_is_as_good_is_not_ruled_out(room, point_light) -> None:
    refiner = refiner_of(room, point_light)
    lenient = SearchOptions(rivals=RivalOptions(deviations=1000.0, energy=1000.0))
    answer, far = (placed(refiner, by) for by in (0.05, 0.15))
    assert [weighed(refiner, answer, [far], (), one)[0].ruled_out for one in (OPTIONS, lenient)] == [True, False]


def test_another_number_is_ruled_out_unless_it_was_doubted(room, point_light) -> None:
    refiner = refiner_of(room, point_light)
    answer, two = placed(refiner, 0.001), placed(refiner, 0.001, 0.2)
    for findings, open_ in (((), False), ((LightMissing(1, 0.9, decided_by=BAR),), True), ((Rival(0.1),), False)):
        [one] = weighed(refiner, answer, [two], findings, OPTIONS)
        assert one.more == 1 and one.ruled_out is not open_
    for findings, open_ in (((), False), ((LightSpare(2, 2, 0.1, 0.5, decided_by=BAR),), True)):
        [one] = weighed(refiner, two, [answer], findings, OPTIONS)
        assert one.more == -1 and one.ruled_out is not open_


def test_what_has_become_the_answer_is_no_alternative(room, point_light) -> None:
    refiner = refiner_of(room, point_light)
    answer, far = (placed(refiner, by) for by in (0.001, 0.15))
    found = weighed(refiner, answer, [far], (), OPTIONS)
    assert still_apart(refiner, answer, found, [], OPTIONS.certainty.doubtful) == found
    assert still_apart(refiner, far, found, [], OPTIONS.certainty.doubtful) == []
    assert still_apart(refiner, answer, found, found, OPTIONS.certainty.doubtful) == []


def test_a_fit_tells_what_it_ruled_out(room, point_light) -> None:
    pair = [point_light(VISIBLE), point_light((-0.3, 0.2, 0.1))]
    [image] = (sum(images) for images in zip(*(room.images(light) for light in pair), strict=True))
    result = fit_lights(room.frozen, room.views[:1], [image], lights=LightSpec(count=None))
    assert len(result.lights) == 2
    fewer = [one for one in result.alternatives if one.more < 0]
    assert len(fewer) == 1 and fewer[0].ruled_out and fewer[0].cost > 1.0 and len(fewer[0].lights) == 1
