"""What tells the fits apart that a study or a report sets beside each other."""

from __future__ import annotations

from rgspipe.config import RgspipeConfig
from rgspipe.config.compared import ComparedFits
from rgspipe.fitting.options import Method


def fit_changes(config: RgspipeConfig, wanted: ComparedFits, method: Method, views: int) -> dict[str, object]:
    """The changes to `config` by which a method fits from a number of views."""
    changes: dict[str, object] = {"fit.method": method, "views.count": views, "views.indices": None}
    limit = wanted.limit_of(method)
    return changes if config.fit.limit is not None or limit is None else changes | {"fit.limit": limit}
