"""Which settings are worth their time: those that no other setting beats in both error and time."""

from __future__ import annotations

import numpy as np
import pandas as pd


def non_dominated(time: np.ndarray, error: np.ndarray) -> np.ndarray:
    """(K,) bool: rows that no other row equals or beats in time and error, and beats in one of them."""
    order = np.lexsort((error, time))
    best, kept = np.inf, np.zeros(len(time), bool)
    for index in order:
        if error[index] < best:
            kept[index], best = True, error[index]
    return kept


def over_rooms(rows: pd.DataFrame) -> pd.DataFrame:
    """Means over the rooms of every numeric column, one row a setting, in the order of first appearance."""
    numeric = rows.select_dtypes("number").columns
    return rows.groupby("setting", sort=False)[list(numeric)].mean().reset_index()


def mark_front(rows: pd.DataFrame, *, time: str, error: str) -> pd.DataFrame:
    """The rows, cheapest first, with a column `on_front`; only rows of one image size can be compared."""
    marked = rows.assign(on_front=non_dominated(rows[time].to_numpy(float), rows[error].to_numpy(float)))
    return marked.sort_values(time).reset_index(drop=True)
