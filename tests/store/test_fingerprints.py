"""What changes a fingerprint and what does not."""

from __future__ import annotations

from rgspipe.store.fingerprints import differences, fingerprint


def test_key_order_does_not_matter_and_values_do() -> None:
    assert fingerprint({"a": 1, "b": [2.0]}) == fingerprint({"b": [2.0], "a": 1})
    assert fingerprint({"a": 1}) != fingerprint({"a": 2})


def test_differences_are_told_in_words() -> None:
    same = {"foreign": {}}
    before = {"config": {"a": {"b": 1, "c": 2}}, "inputs": {"x": ["1"]}, "code": {"m": "1"}, "sums": "of one", **same}
    now = {"config": {"a": {"b": 5, "c": 2}}, "inputs": {"x": ["2"]}, "code": {"m": "2"}, "sums": "of two", **same}
    assert differences(now, before) == ["a.b 1 → 5", "the code of m changed", "another x", "sums of one → of two"]
    assert differences(now, now) == []
    moved, changed = now | {"foreign": {"b": "7"}}, now | {"foreign": {"a": "8"}}
    assert differences(moved, now | {"foreign": {"a": "7"}}) == ["a is now b"]
    assert differences(changed, now | {"foreign": {"a": "7"}}) == ["the files in a changed"]
