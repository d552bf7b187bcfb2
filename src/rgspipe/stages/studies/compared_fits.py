"""What tells the fits apart that a study or a report sets beside each other."""

from __future__ import annotations

from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.config.compared import ComparedFits
from rgspipe.datasets.frames import read_entries
from rgspipe.fitting.options import Method
from rgspipe.stages.sources import has_truth


def fits_of(config: RgspipeConfig, wanted: ComparedFits) -> list[tuple[Method, int]]:
    """Each method with each of its numbers of views, as far as the target has so many.

    Raises:
        InputError: a target of the user's own cannot be read.
    """
    return list(dict.fromkeys((method, at_most(config, views)) for method, views in wanted.fits()))


def at_most(config: RgspipeConfig, views: int) -> int:
    """A number of views, or all that targets have, if these are fewer and known before anything is made.

    Raises:
        InputError: a target of the user's own cannot be read.
    """
    if config.fit.target is None:
        rendered = has_truth(config) and config.fit.targets != "generated"
        return min(views, config.dataset.target_views) if rendered else views
    return min(views, len(read_entries(Path(config.fit.target) / "transforms.json", "the cameras of a fit target")))


def fit_changes(config: RgspipeConfig, wanted: ComparedFits, method: Method, views: int) -> dict[str, object]:
    """The changes to `config` by which a method fits from a number of views."""
    changes: dict[str, object] = {"fit.method": method, "views.count": views, "views.indices": None}
    limit = wanted.limit_of(method)
    return changes if config.fit.limit is not None or limit is None else changes | {"fit.limit": limit}
