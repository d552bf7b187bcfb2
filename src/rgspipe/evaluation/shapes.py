"""Errors of shapes, each in the unit of its kind of light: those of different kinds are not compared."""

from __future__ import annotations

import math

import pandas as pd

from rgspipe.scene import LightRig
from rgspipe.scene.lights import KINDS

#: Between the kinds of a rig.
AND = ", "


def shape_kind(rig: LightRig) -> str | None:
    """The kind of the lights that have a shape, of several kinds all of them by name; None where none has one."""
    return AND.join(sorted({light.kind for light in rig if light.shape})) or None


def is_one_kind(kind: str | None) -> bool:
    """Whether errors of shapes of `shape_kind` have one unit."""
    return kind is not None and AND not in kind


def common_shape_kind(targets: pd.DataFrame) -> str | None:
    """The one kind of light that the shapes of targets are of; None where they are of none, or of several.

    Args:
        targets: rows of `tables.target_table`.
    """
    kinds = list(targets["shape_kind"].dropna().unique())
    return kinds[0] if len(kinds) == 1 and is_one_kind(kinds[0]) else None


def told_shape_error(value: float, kind: str) -> str:
    """ "1.25°" of a spot; of other kinds with their decimals, at least two."""
    number = KINDS[kind].shaped().shape[0]
    return f"{value:.{max(2, number.decimals or 0)}f}{number.unit}"


def shape_errors(targets: pd.DataFrame) -> pd.Series:
    """Of each target; NaN where the targets are of several kinds."""
    known = targets["shape_error"].astype(float)
    return known if common_shape_kind(targets) is not None else known * math.nan
