"""The order of names with numbers in them, such as those of frames."""

from __future__ import annotations

import math
import re


def name_order(name: str) -> tuple[list[tuple[float, str]], str]:
    """A key to sort names by: numbers in them count by their value, so that frame_2 goes before frame_10."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(part), "") if part.isdecimal() else (math.inf, part) for part in parts], name
