"""Options say what they are once, and refuse whatever they are not."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rgspipe.errors import InputError
from rgspipe.options import Options, option, settings, shown


@dataclass(frozen=True)
class Base(Options):
    rate: float = option(0.5, low=0, high=1)
    """how fast,
    and how far"""


@dataclass(frozen=True)
class Inner(Options):
    kind: Literal["point", "spot"] = "point"
    angle: float = 3.0


@dataclass(frozen=True)
class Outer(Base):
    count: int = option(1, low=1, high=8)
    """how many"""
    name: str | None = None
    folder: Path | None = None
    place: tuple[float, float, float] = option((0.0, 0.0, 0.0), low=-1, high=1)
    kinds: tuple[Literal["a", "b"], ...] = ()
    on: bool = True
    inner: Inner = Inner()
    foreign: object = None

    def check(self) -> None:
        if self.count == 5:
            raise InputError("count", expected="no 5", found="5", remedy="Take 4.")


def test_values_take_the_types_of_their_fields() -> None:
    found = Outer(rate=1, count=np.int64(3), name=12, folder="a/b", place=[0, 1, -1], kinds=["b"], on="no")
    assert (found.rate, found.count, found.name, found.folder) == (1.0, 3, "12", Path("a/b"))
    assert type(found.rate) is float and type(found.count) is int
    assert (found.place, found.kinds, found.on) == ((0.0, 1.0, -1.0), ("b",), False)
    assert Outer(count="4").count == 4, "a resolver of the environment gives text"


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"count": 0}, r"^count: expected a value from 1 to 8 \(how many\), found 0"),
        ({"count": 2.5}, "^count: expected a whole number, found 2.5"),
        ({"count": True}, "^count: expected a whole number, found true"),
        ({"count": "many"}, "whole number, found many"),
        ({"count": None}, "^count: expected a value, found null"),
        ({"rate": math.nan}, "^rate: expected a value from 0 to 1 .how fast, and how far., found nan"),
        ({"rate": "inf"}, "^rate"),
        ({"name": ""}, r"^name: expected text, found ''\. Leave it away, or say null\."),
        ({"folder": ""}, "^folder: expected text, found ''"),
        ({"on": 1}, "^on: expected true or false, found 1"),
        ({"place": [0, 0]}, r"^place: expected 3 values, found \[0,0\]"),
        ({"place": 1.0}, "^place: expected a list, found 1.0"),
        ({"place": [0, 0, 2]}, "^place: expected a value from -1 to 1"),
        ({"kinds": ["a", "c"]}, "^kinds: expected one of a, b, found c"),
        ({"inner": "point"}, "^inner: expected values for some of kind, angle, found point"),
        ({"inner": {"kind": "led"}}, r"^inner\.kind: expected one of point, spot, found led"),
        ({"inner": {"kinds": "spot"}}, r"^inner\.kinds: expected the name of an option, .* Did you mean kind\?"),
        ({"inner": {1: "spot"}}, "^inner: expected values for some of kind, angle"),
        ({"cuont": 3}, r"^cuont: expected the name of an option, found no such option\. Did you mean count\?"),
        ({"xyz": 3}, r"^xyz: .* There are rate, count, name, folder, place, kinds, on, inner, foreign\."),
        ({"count": 5}, "^count: expected no 5"),
    ],
)
def test_what_is_none_is_refused_with_the_field(values: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Outer(**values)
    with pytest.raises(InputError, match=words):
        replace(Outer(), **values)


def test_nested_options_are_given_by_name() -> None:
    assert Outer(inner={"angle": 1}).inner == Inner(angle=1.0) and Outer(inner={}) == Outer()


def test_settings_are_read_from_the_class() -> None:
    found = {setting.name: setting for setting in settings(Outer)}
    assert list(found) == ["rate", "count", "name", "folder", "place", "kinds", "on", "inner"]
    assert found["rate"].help == "how fast, and how far" and found["count"].help == "how many"
    assert (found["count"].range, found["kinds"].range, found["name"].range) == ("1 to 8", "a | b", "")
    assert found["inner"].section is Inner and found["folder"].optional


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3), st.integers(1, 4))
def test_whatever_is_in_range_is_kept(place: list[float], count: int) -> None:
    found = Outer(place=place, count=count)
    assert found.place == tuple(place) and found.count == count
    assert Outer(**vars(found)) == found


def test_values_are_shown_as_they_are_typed() -> None:
    assert shown([None, True, (1, 2.5), "a"]) == "[null,true,[1,2.5],a]"
