"""Classes of targets by what the cameras see of their lights, in the order in which all that is shown has them."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from rgspipe.datasets.classes import LIGHT_CLASSES

#: Occlusion classes in the order in which every table and figure shows them.
CLASSES = (*LIGHT_CLASSES, "mixed", "unknown")
#: The row that holds all targets of a method and view count.
ALL = "all"


def class_order(names: Sequence[str] | pd.Series) -> list[str]:
    """The distinct class names: the known ones in their fixed order, then others by name."""
    found = set(names)
    return [name for name in CLASSES if name in found] + sorted(found - set(CLASSES))


def class_of(listed: str, lights: int) -> str:
    """The class under which a target is shown: one of several lights that belong to none together is "mixed"."""
    return "mixed" if listed == "unknown" and lights > 1 else listed
