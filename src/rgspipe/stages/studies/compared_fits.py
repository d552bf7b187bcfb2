"""What tells the fits apart that a study or a report sets beside each other."""

from __future__ import annotations

from rgspipe.config import RgspipeConfig
from rgspipe.config.compared import ComparedFits
from rgspipe.fitting.options import Method
from rgspipe.stages.lights.targets import known_targets
from rgspipe.stages.sources import has_truth


def fits_of(config: RgspipeConfig, wanted: ComparedFits) -> list[tuple[Method, int]]:
    """Each method with each of its numbers of views, as far as targets have so many.

    Raises:
        InputError: see `at_most`.
    """
    return list(dict.fromkeys((method, at_most(config, views)) for method, views in wanted.fits()))


def at_most(config: RgspipeConfig, views: int) -> int:
    """A number of views, or all that every target has, if these are fewer and known before anything is made.

    Raises:
        InputError: targets that are on disk cannot be read, or none is of the wanted class.
    """
    rendered = config.fit.target is None and config.fit.targets != "generated" and has_truth(config)
    counts = [config.dataset.target_views] if rendered else [target.views for target in known_targets(config)]
    return min([views, *counts])


def fit_changes(config: RgspipeConfig, wanted: ComparedFits, method: Method, views: int) -> dict[str, object]:
    """The changes to `config` by which a method fits from a number of views."""
    changes: dict[str, object] = {"fit.method": method, "views.count": views, "views.indices": None}
    limit = wanted.limit_of(method)
    return changes if config.fit.limit is not None or limit is None else changes | {"fit.limit": limit}
