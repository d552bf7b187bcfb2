"""What each number that steers a search is worth: fits with it halved and doubled, on targets of known lights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.evaluation import metrics
from rgspipe.evaluation.markdown import markdown_table
from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.fitting import FitStatus, FitViews, Search
from rgspipe.options import Options, check_names, settings
from rgspipe.progress import progress_bar
from rgspipe.scene import Light, LightRig

FACTORS = (0.5, 2.0)

#: Standard deviation of the noise in images that the scene renders itself, a part of their mean.
NOISE = 0.02

COLUMNS = {
    "setting": ("setting", "s"),
    "value": ("value", "s"),
    "solved": ("solved", ".0f"),
    "error": ("median error (%)", ".3f"),
    "silent": ("wrong without a word", ".0f"),
    "evaluations": ("renderings a fit", ".0f"),
    "seconds": ("s a fit", ".2f"),
}


@dataclass(frozen=True)
class KnownTarget:
    """Images whose lights are known.

    Attributes:
        images: (H, W, 3) of each view.
        truth: the lights.
        views: made ready, with what the fit is told of the lights.
    """

    images: Sequence[Tensor]
    truth: LightRig
    views: FitViews


def search_table(
    targets: Sequence[KnownTarget], size: float, usual: Search | None = None, names: Sequence[str] | None = None
) -> pd.DataFrame:
    """One row for the settings as they are, and one for each number halved and doubled.

    Args:
        size: the scene's, for errors as shares of it.
        usual: the settings as they are.
        names: of the numbers, or of sections of them; all by default.

    Raises:
        InputError: there is no such number.
    """
    usual = usual or Search()
    tried = [("as it is", "", usual), *varied(usual, names)]
    rows = [
        {"setting": name, "value": value, **_outcome(targets, options, size)}
        for name, value, options in progress_bar(tried, "settings of the search", unit="setting")
    ]
    return pd.DataFrame(rows)


def varied(options: Search, names: Sequence[str] | None = None) -> Iterator[tuple[str, str, Search]]:
    """Each number of the options, nested ones by dotted names, halved and doubled where its range allows that.

    Args:
        names: of the numbers, or of sections of them; all by default.

    Raises:
        InputError: there is no such number.
    """
    for name in _chosen(list(numbers(type(options))), names):
        value = _get(options, name)
        for factor in FACTORS:
            changed = _scaled(value, factor)
            try:
                other = _with(options, name.split("."), changed)
            except InputError:
                continue
            if changed != value:
                yield name, str(changed), other


def rendered_spots(views: FitViews, places: Sequence[Light], seed: int = 0) -> list[KnownTarget]:
    """Spots at the places of lights, aimed at random, as the scene itself shows them, with noise of NOISE of the mean.

    Args:
        views: made ready for one spot.
    """
    generator, [kind] = torch.Generator().manual_seed(seed), views.lights.kinds
    known = []
    for place in places:
        axis = torch.randn(3, generator=generator, dtype=torch.float64)
        light = kind.at(place.position.double(), axis / axis.norm(), place.intensity.double())
        images = views.render(light)
        mean = float(torch.stack([image.mean() for image in images]).mean())
        noise = [torch.randn(image.shape, generator=generator) for image in images]
        pairs = zip(images, noise, strict=True)
        known.append(KnownTarget([image + NOISE * mean * one.to(image) for image, one in pairs], (light,), views))
    return known


def search_markdown(table: pd.DataFrame) -> str:
    """The table as it stands in docs/."""
    return markdown_table(table, COLUMNS)


def _outcome(targets: Sequence[KnownTarget], options: Search, size: float) -> dict[str, float]:
    """How often and how well targets are solved, and what that takes."""
    results = [one.views.fit(one.images, solver=options) for one in targets]
    errors = [
        rig_errors(found.lights, one.truth, size).position if len(found.lights) == len(one.truth) else np.inf
        for found, one in zip(results, targets, strict=True)
    ]
    solved = [error <= metrics.SUCCESS_LIMIT for error in errors]
    silent = [not right and found.status is FitStatus.CONVERGED for right, found in zip(solved, results, strict=True)]
    return {
        "solved": sum(solved),
        "error": 100.0 * float(np.median(errors)),
        "silent": sum(silent),
        "evaluations": float(np.mean([found.evaluations for found in results])),
        "seconds": float(np.mean([found.seconds for found in results])),
    }


def numbers(options: type[Options], prefix: str = "") -> Iterator[str]:
    """The dotted names of all numbers among options, nested ones included."""
    for setting in settings(options):
        if setting.section is not None:
            yield from numbers(setting.section, f"{prefix}{setting.name}.")
        elif setting.type in (int, float):
            yield f"{prefix}{setting.name}"


def _chosen(every: Sequence[str], names: Sequence[str] | None) -> list[str]:
    """Those of all numbers that are named, or whose section is."""
    sections = {name.rpartition(".")[0] for name in every} - {""}
    check_names(names or (), [*every, *sorted(sections)])
    return [name for name in every if names is None or name in names or name.rpartition(".")[0] in names]


def _get(options: Options, name: str) -> Any:
    for part in name.split("."):
        options = getattr(options, part)
    return options


def _scaled(value: Any, factor: float) -> Any:
    if isinstance(value, tuple):
        return tuple(_scaled(one, factor) for one in value)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


def _with(options: Any, path: Sequence[str], value: Any) -> Any:
    """The options with one number changed; frozen and checked as ever."""
    first, *rest = path
    changed = value if not rest else _with(getattr(options, first), rest, value)
    return replace(options, **{first: changed})
