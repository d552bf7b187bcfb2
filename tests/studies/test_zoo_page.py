"""The page of the zoo: both kinds of seeds apart, every room, and all that went wrong by name."""

from __future__ import annotations

from rgspipe.studies.zoo_page import TITLES, page
from rgspipe.studies.zoo_rooms import FINAL, WORK
from zoo_fits import five_rooms, five_rooms_figures


def _parts() -> dict[str, str]:
    text = page(five_rooms(), five_rooms_figures())
    _, work, final = text.split("\n## ")
    assert work.startswith(TITLES[WORK]) and final.startswith(TITLES[FINAL])
    return {WORK: work, FINAL: final}


def test_odd_and_even_seeds_are_reported_apart() -> None:
    parts = _parts()
    assert "| all fits | all | 1 | 3 | 9 | 33 % (10–70) |" in parts[WORK]
    assert "| all fits | all | 3 | 2 | 6 | 50 % (19–81) |" in parts[FINAL]


def test_what_went_wrong_is_named() -> None:
    parts = _parts()
    assert "### Wrong without a word" in parts[WORK] and "Wrong without" not in parts[FINAL]
    assert "| 1 | clean | occluded | 3 | 5.00% | 5.00% | 2.50% | 35.0 | 20.0% | fair | converged |" in parts[WORK]
    assert "### Graded good, and off by more than 3 %" in parts[WORK] and "Graded good" not in parts[FINAL]
    assert parts[WORK].count(r"no place \| for a camera") == 1, "once, not for each number of views and class"
    assert "| 2 | clean | train_surfels | the loss is NaN |" in parts[FINAL]


def test_every_room_is_listed_once_with_what_is_known_of_it() -> None:
    rooms = _parts()[WORK].partition("### The rooms")[2].partition("###")[0].splitlines()
    assert [row.split(" | ")[0] for row in rooms[4:] if row] == ["| 1", "| 3", "| 5"]
    assert rooms[4].endswith("| 30 | 35 | 2.0% | 10.0% | 20.0% | 35.0 | 90 | fair | 2.0% |")
    assert rooms[6].endswith("| 40 | – | 2.0% | – | – | – | – | – | – |")
