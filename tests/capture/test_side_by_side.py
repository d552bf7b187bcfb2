"""Work on several items at once gives what it gives one after the other."""

from __future__ import annotations

from threading import Barrier

import pytest

from rgspipe.capture import side_by_side as module
from rgspipe.capture.side_by_side import kept_property, side_by_side


def test_items_are_worked_on_at_once_and_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "thread_count", lambda: 2)
    both = Barrier(2, timeout=30.0)

    def work(item: int) -> int:
        both.wait()
        return 10 * item

    assert side_by_side(work, range(4)) == [0, 10, 20, 30]


def test_one_thread_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "thread_count", lambda: 1)
    assert side_by_side(str, [3, 1]) == ["3", "1"]
    assert side_by_side(str, []) == []


def test_what_is_kept_is_made_once_for_each_object_and_for_several_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Factorisations of several fields: with a lock that all of them share, neither thread would get to the barrier."""
    monkeypatch.setattr(module, "thread_count", lambda: 2)
    both, made = Barrier(2, timeout=30.0), []

    class Made:
        @kept_property
        def number(self) -> int:
            both.wait()
            made.append(self)
            return len(made)

    first, second = Made(), Made()
    assert sorted(side_by_side(lambda one: one.number, [first, second])) == [1, 2]
    assert sorted([first.number, second.number]) == [1, 2]
    assert len(made) == 2
