"""Which targets are fitted, and with which of their views."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Protocol, TypeVar

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.gs3 import TargetFolder, load_target, target_folders
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


def known_targets(config: RgspipeConfig) -> list[TargetFolder]:
    """The targets that lie on disk before anything is made: the user's own, or those of a dataset that was there.

    Raises:
        InputError: their cameras cannot be read, or none is of the wanted class.
    """
    if config.fit.target is not None:
        return [TargetFolder.of(config.fit.target)]
    if config.scene.kind != "external" or config.fit.targets == "generated" or config.scene.path is None:
        return []
    return select_targets([TargetFolder.of(folder) for folder in target_folders(config.scene.path)], config)


def require_views(config: RgspipeConfig) -> None:
    """Refuse, before anything is made, to fit more views than targets have that lie on disk.

    Raises:
        InputError: see `known_targets`, or a target has fewer.
    """
    for target in known_targets(config):
        used_indices(target.name, target.views, config)


class _Classed(Protocol):
    @property
    def occlusion(self) -> str: ...


_Target = TypeVar("_Target", bound=_Classed)


def select_targets(targets: Sequence[_Target], config: RgspipeConfig) -> list[_Target]:
    """The targets of the wanted class, at most `fit.limit` of each.

    Raises:
        InputError: there is none.
    """
    if config.fit.target is not None:
        return list(targets)
    if not targets:
        raise InputError(
            "fit.target",
            expected="the folder of a target, as the dataset has none of its own",
            found="null",
            remedy="Name one with fit.target=DIR: images whose lights are unknown, and their cameras in a "
            "transforms.json (docs/guides/your_own_scene.md).",
        )
    chosen: list[_Target] = []
    for target in targets:
        before = sum(other.occlusion == target.occlusion for other in chosen)
        wanted = config.occlusion in ("all", target.occlusion)
        if wanted and (config.fit.limit is None or before < config.fit.limit):
            chosen.append(target)
    if not chosen:
        classes = sorted({target.occlusion for target in targets})
        raise InputError(
            "occlusion",
            expected=f"a class that the dataset has targets of: {', '.join(classes)}",
            found=config.occlusion,
            remedy="Choose another class, or fit a folder of your own with fit.target=DIR.",
        )
    return chosen


def used_views(target: Target, config: RgspipeConfig) -> list[View]:
    """The views of a target that the configuration asks for.

    Raises:
        InputError: the target has fewer.
    """
    return [target.views[index] for index in used_indices(target.name, len(target.views), config)]


def used_indices(target: str, views: int, config: RgspipeConfig) -> list[int]:
    """Which views of a target that has so many the configuration asks for.

    Raises:
        InputError: the target has fewer.
    """
    indices = config.views.indices if config.views.indices is not None else list(range(config.views.count))
    if max(indices) >= views or len(set(indices)) < len(indices):
        key = "views.count" if config.views.indices is None else "views.indices"
        raise InputError(
            key,
            expected=f"different cameras of the {views} that target {target} has",
            found=str(config.views.count if config.views.indices is None else indices),
            remedy="Ask for fewer views, or add images to the target.",
        )
    return list(indices)


def view_keys(config: RgspipeConfig) -> list[str]:
    """Those of `views` that say which views of a target are used."""
    return ["views.count" if config.views.indices is None else "views.indices"]


def target_seed(target: Target, config: RgspipeConfig) -> int:
    """A seed of the target's own, so that a start does not depend on which other targets are fitted."""
    return zlib.crc32(f"{config.seed}/{STREAM}/{target.name}".encode())
