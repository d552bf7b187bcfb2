"""Which targets are fitted, and with which of their views."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.views import Target, View
from rgspipe.errors import InputError
from rgspipe.stages.base import StageContext
from rgspipe.stages.sources import target_stage

#: Number of the random stream of fits; part of the seed, so never renumber it.
STREAM = 0


def all_targets(context: StageContext) -> Sequence[Target]:
    """The targets of the fit's stage, or the user's own."""
    if context.config.fit.target is not None:
        return [load_target(context.config.fit.target, context.config.fit.base)]
    [stage] = target_stage(context.config)
    return open_dataset(context.inputs[stage].folder(), train=False, test=False).targets


def select_targets(targets: Sequence[Target], config: RgspipeConfig) -> list[Target]:
    """The targets of the wanted class, at most `fit.limit` of each.

    Raises:
        InputError: there is none.
    """
    if config.fit.target is not None:
        return list(targets)
    chosen: list[Target] = []
    for target in targets:
        before = sum(other.occlusion == target.occlusion for other in chosen)
        wanted = config.occlusion in ("all", target.occlusion)
        if wanted and (config.fit.limit is None or before < config.fit.limit):
            chosen.append(target)
    if not chosen:
        classes = sorted({target.occlusion for target in targets})
        raise InputError(
            "occlusion",
            expected=f"a class that the dataset has targets of: {', '.join(classes) or 'it has no targets at all'}",
            found=config.occlusion,
            remedy="Choose another class, or fit a folder of your own with fit.target=DIR.",
        )
    return chosen


def used_views(target: Target, config: RgspipeConfig) -> list[View]:
    """The views of a target that the configuration asks for.

    Raises:
        InputError: the target has fewer.
    """
    indices = config.views.indices if config.views.indices is not None else list(range(config.views.count))
    if max(indices) >= len(target.views) or len(set(indices)) < len(indices):
        key = "views.count" if config.views.indices is None else "views.indices"
        raise InputError(
            key,
            expected=f"different cameras of the {len(target.views)} that target {target.name} has",
            found=str(config.views.count if config.views.indices is None else indices),
            remedy="Ask for fewer views, or add images to the target.",
        )
    return [target.views[index] for index in indices]


def target_seed(target: Target, config: RgspipeConfig) -> int:
    """A seed of the target's own, so that a start does not depend on which other targets are fitted."""
    return zlib.crc32(f"{config.seed}/{STREAM}/{target.name}".encode())
