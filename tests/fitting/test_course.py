"""How far a fit is: what is left is counted in efforts at the pace so far; what turns out to be needed is added."""

from __future__ import annotations

import re

import pytest

from rgspipe.fitting.course import GROWTH, Course, effort_after, effort_of, weight
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.spec import LightSpec
from rgspipe.progress import progress_told
from rgspipe.scene.lights import PanelLight, PointLight, SphereLight, SpotLight


class Clock:
    """Time that passes when it is told to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr("tqdm.std.time", made)
    monkeypatch.setattr("rgspipe.progress.QUIET_SECONDS", 0.0)
    return made


def left(line: str) -> tuple[str, int, int]:
    """The part, per cent and seconds of a line."""
    words, percent, minutes, seconds = re.fullmatch(r"(.*): (\d+) %, (\d+):(\d+) left in all", line).groups()
    return words, int(percent), 60 * int(minutes) + int(seconds)


def test_what_is_left_is_all_that_is_known_at_the_pace_so_far(clock: Clock) -> None:
    """Two parts of efforts 4 and 12, of which an effort takes 10 s; then 8 more turn out to be needed."""
    told: list[str] = []
    with progress_told(told.append), Course.shown(16.0) as course:
        with course.part("starts", 4.0, pieces=4):
            for _ in range(3):
                clock.now += 10.0
                course.piece()
            clock.now += 10.0
        course.further(8.0)
        with course.part("polishing", 12.0):
            for taken in (1, 2, 3):
                clock.now += 20.0
                course.step(taken, most=30)
            clock.now += 60.0
        with course.part("more", 8.0):
            clock.now += 80.0
    # Nothing is known before the first piece is done; steps are shares of the six that are usual.
    assert told[0] == "looking for lights" and told[-1] == ""
    assert [left(line) for line in told[1:-1]] == [
        ("starts", 6, 150),
        ("starts", 12, 140),
        ("starts", 19, 130),
        ("starts", 25, 120),
        ("polishing", 25, 180),
        ("polishing", 33, 160),
        ("polishing", 42, 140),
        ("polishing", 67, 80),
        ("more", 100, 0),
    ]


def test_what_takes_more_than_was_expected_is_never_done_before_it_is(clock: Clock) -> None:
    told: list[str] = []
    with progress_told(told.append), Course.shown(1.0) as course, course.part("starts", 2.0, pieces=2):
        for _ in range(6):
            clock.now += 1.0
            course.piece()
        clock.now += 1.0
    assert [left(line)[1] for line in told[1:-1]] == [50, 67, 75, 80, 83, 86, 100]


def test_a_course_that_nobody_watches_is_silent(capsys: pytest.CaptureFixture[str]) -> None:
    course = Course()
    course.further(1.0)
    with course.polishing(1, 2):
        course.step(1, most=3)
        course.piece()
    assert capsys.readouterr() == ("", "")


def test_an_unknown_number_is_planned_as_one_light_and_a_second_that_is_tried() -> None:
    one, two, open_number = (effort_of(LightSpec("point", count=count)) for count in (1, 2, None))
    assert one < open_number < two
    assert two - one > effort_after(2**GROWTH) - effort_after(1) > 0.0


@pytest.mark.parametrize(
    ("kinds", "times"), [(["point"], 1), (["point"] * 2, 2.8), (["spot"], 2.8), (["sphere"], 6), (["panel"], 11.3)]
)
def test_an_answer_weighs_what_its_lights_are_rendered_and_unknowns_take(kinds: list[str], times: float) -> None:
    made = {
        "point": PointLight([0, 0, 0], [1, 1, 1]),
        "spot": SpotLight([0, 0, 0], [1, 1, 1], [0, 0, -1], "gaussian", 0.6, 0.3),
        "sphere": SphereLight([0, 0, 0], [1, 1, 1], 0.1),
        "panel": PanelLight([0, 0, 0], [1, 1, 1], [0, 0, -1], 0.2, 0.1),
    }
    assert weight([Emitter.of(made[kind]) for kind in kinds]) == pytest.approx(times, rel=0.02)
