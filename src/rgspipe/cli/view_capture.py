"""What the page of a capture shows beside its scene: its lamps, and the photographs that they were found in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatch

import torch

from rgspipe.capture.refusals import OFF
from rgspipe.config import RgspipeConfig
from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_views import degraded
from rgspipe.store.artifacts import Artifact
from rgspipe.viewer.material import Case, Found, Photograph

#: At most so many photographs are searched: each takes some seconds before the first search, and lamps that a capture
#: has found are as well known by a few.
MOST_SEARCHED = 6

#: The artifact of a stage; None where it is not made.
Find = Callable[[str], Artifact | None]


def captured(find: Find, config: RgspipeConfig) -> list[Case]:
    """The lamps that a capture found, if the scene is one, with its photographs: a case for each lighting."""
    capture = find("capture_surfels") if config.scene.lamps == "unknown" else None
    if capture is None:
        return []
    measured, cases = read_json(capture.file("metrics.json"), "the measures of a capture"), []
    views = _views(find("generate_dataset"), config)
    lacking = _unsearched(views, config)
    for name in sorted(name for name in capture.manifest["files"] if fnmatch(name, "lamps*.json")):
        path, lighting = capture.file(name), name.removesuffix(".json").removeprefix("lamps").removeprefix("_")
        own = measured.get("others", {}).get(lighting, measured)
        found = Found(read_lights(path), read_covariances(path), own["words"])
        photographs = [] if lacking else _photographs(views[lighting], own["exposures"])
        cases.append(Case(f"capture {lighting}".strip(), photographs, found=found, lacking=lacking))
    return cases


def _views(dataset: Artifact | None, config: RgspipeConfig) -> Mapping[str, Sequence[View]]:
    """The photographs of a capture by their lighting, as its lamps were found in them."""
    if dataset is None:
        return {}
    views = degraded(open_dataset(dataset.folder(), test=False, targets=False).train, config.capture)
    return {name: [view for view in views if view.lighting == name] for name in {view.lighting for view in views}}


def _unsearched(views: Mapping[str, Sequence[View]], config: RgspipeConfig) -> str:
    """Why a search on the page cannot take the photographs of a capture, in a sentence; empty where it can."""
    causes = {
        "are gone": not views,
        "have other light in them, too": OFF in views,
        "are darker towards their corners": config.lamps.vignetting,
        "have a curve of their camera's own": config.lamps.response != "known",
    }
    found = next((what for what, holds in causes.items() if holds), None)
    return "" if found is None else f"Lamps cannot be looked for here again: the photographs {found}."


def _photographs(views: Sequence[View], gains: Sequence[Sequence[float]]) -> list[Photograph]:
    """Some of the photographs, evenly spaced, brought to one exposure by `gains` (V, 3)."""
    chosen = range(0, len(views), math.ceil(len(views) / MOST_SEARCHED))
    taken = [(Photograph.of(views[index], views[index].name), torch.tensor(gains[index])) for index in chosen]
    return [replace(one, image=one.image / gain) for one, gain in taken]
