"""What was asked for last is kept, as far as there is room."""

from __future__ import annotations

from rgspipe.viewer.kept import Kept


def test_the_last_values_are_kept_by_number() -> None:
    kept: Kept[int] = Kept(2)
    made: list[int] = []

    def ask(key: int) -> int:
        return kept.get(key, lambda: made.append(key) or key)

    assert [ask(key) for key in (1, 2, 1, 3, 1, 2)] == [1, 2, 1, 3, 1, 2]
    # 2 had to go for 3, as 1 was asked for after it.
    assert made == [1, 2, 3, 2] and 3 not in kept and 1 in kept


def test_values_take_room_and_the_last_one_is_always_kept() -> None:
    kept: Kept[bytes] = Kept(10, len)
    kept.get("a", lambda: bytes(4))
    kept.get("b", lambda: bytes(6))
    assert "a" in kept and "b" in kept
    kept.get("c", lambda: bytes(5))
    assert "a" not in kept and "b" not in kept and "c" in kept
    kept.get("d", lambda: bytes(50))
    assert "d" in kept and "c" not in kept
