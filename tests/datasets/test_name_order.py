"""Names are sorted as people count."""

from __future__ import annotations

import random

import pytest

from rgspipe.datasets.name_order import name_order


@pytest.mark.parametrize(
    "names",
    [
        ["frame_1", "frame_2", "frame_10", "frame_10b", "frame_11"],
        ["0", "3", "12", "a", "a0", "a1_9", "a1_10", "b"],
        ["", "7", "007x", "x"],
        ["١", "2", "٣"],
    ],
    ids=["frames", "numbers go before words", "beside nothing", "digits of other scripts"],
)
def test_numbers_in_names_count_by_their_value(names: list[str]) -> None:
    shuffled = random.Random(3).sample(names, len(names))
    assert sorted(shuffled, key=name_order) == names


def test_names_that_are_equal_as_numbers_have_one_order_all_the_same() -> None:
    """Folders are listed in any order; what is made of them is not to depend on it."""
    names = ["frame_1", "frame_01", "frame_001"]
    other = list(reversed(names))
    assert sorted(names, key=name_order) == sorted(other, key=name_order)
