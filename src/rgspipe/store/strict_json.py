"""JSON without what other readers pass over, or end at: keys twice, endless integers, deep nesting.

NaN and infinity are left to those who know which key they stand for.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

#: Digits of the largest integer that a double can hold.
MOST_DIGITS = 308


def as_json(value: Any) -> Any:
    """A value as strict JSON knows it: NaN is null, infinity the text "inf", and tuples are lists."""
    if isinstance(value, Mapping):
        return {key: as_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "inf"
    return value


def parse_json(text: str) -> object:
    """The value that a JSON text stands for.

    Raises:
        ValueError: it is no JSON, nested too deeply, or has a key twice or an integer that no double can hold.
    """
    try:
        return json.loads(text, parse_int=_integer, object_pairs_hook=_unique)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _integer(text: str) -> int:
    if len(text.lstrip("-")) > MOST_DIGITS:
        raise ValueError(f"an integer of {len(text.lstrip('-'))} digits")
    return int(text)


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    content = dict(pairs)
    if len(content) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))
        raise ValueError(f"the key {twice!r:.80} is there twice")
    return content
