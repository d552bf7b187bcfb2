"""The front of settings: what nothing else beats, and nothing more."""

from __future__ import annotations

import numpy as np
import pandas as pd
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.benchmark.figures import front_figure, scaling_figure
from rgspipe.benchmark.front import mark_front, non_dominated, over_rooms
from rgspipe.evaluation.plots import svg_bytes

NUMBERS = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=1, max_size=20)


@given(NUMBERS)
@settings(derandomize=True, deadline=None)
def test_a_row_is_on_the_front_if_no_other_beats_it(pairs: list[tuple[int, int]]) -> None:
    time, error = (np.array(column, float) for column in zip(*pairs, strict=True))
    kept = non_dominated(time, error)
    for i in range(len(time)):
        no_worse = (time <= time[i]) & (error <= error[i])
        beaten = bool((no_worse & ((time < time[i]) | (error < error[i]))).any())
        # Of equal rows one stands for all.
        twin = bool((kept & (time == time[i]) & (error == error[i])).any())
        assert (kept[i] or (not beaten and twin)) if not beaten else not kept[i]


def rows() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "room": ["a", "b", "a", "b", "a", "b"],
            "setting": ["x", "x", "y", "y", "z", "z"],
            "step_ms": [1.0, 3.0, 4.0, 6.0, 5.0, 7.0],
            "first_ms": [10.0, 30.0, 40.0, 60.0, 50.0, 70.0],
            "global_relative": [0.4, 0.2, 0.1, 0.1, 0.2, 0.2],
        }
    )


def test_rooms_are_averaged_and_the_front_marked() -> None:
    marked = mark_front(over_rooms(rows()), time="step_ms", error="global_relative")
    assert marked["setting"].tolist() == ["x", "y", "z"]
    assert marked["step_ms"].tolist() == [2.0, 5.0, 6.0]
    assert marked["on_front"].tolist() == [True, True, False]


def test_the_figures_are_drawn_with_and_without_peers() -> None:
    marked = mark_front(over_rooms(rows()), time="step_ms", error="global_relative")
    peers = pd.DataFrame(
        {"renderer": ["peer"], "spp": [16.0], "step_ms": [np.nan], "first_ms": [9.0], "global_relative": [0.3]}
    )
    alone, beside = (
        svg_bytes(front_figure(marked, frame, error="global_relative")) for frame in (peers.iloc[:0], peers)
    )
    assert len(beside) > len(alone) > 10_000
    growth = pd.DataFrame(
        {
            "surfels": [10, 10, 20, 20],
            "part": ["p", "q"] * 2,
            "ms": [1.0, 2.0, 2.0, 5.0],
            "operators_mib": 1.0,
            "peak_mib": 2.0,
        }
    )
    assert len(svg_bytes(scaling_figure(growth))) > 10_000
