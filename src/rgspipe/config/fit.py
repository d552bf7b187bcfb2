"""From images of the frozen scene to lights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.fitting.options import AdamOptions, Method, SearchOptions
from rgspipe.options import Options, option


@dataclass(frozen=True)
class SearchConfig(SearchOptions):
    """How `fit=search_lm` searches."""

    mask_edges: bool = True
    """leave out pixels at depth and normal edges"""


@dataclass(frozen=True)
class FitConfig(Options):
    """From images of the frozen scene to lights."""

    method: Method = "search_lm"
    """the method"""
    target: str | None = None
    """a target's folder; by default the dataset's own targets"""
    base: str | None = None
    """folder of images like those of `target`, from the same cameras, with the lamps off: what was there anyway"""
    base_scale: Literal["known", "free"] = "known"
    """whether that is in the target as it is, or a factor times, per colour, that is found, too"""
    truth: str | None = None
    """light file with the true lights of `target`, for evaluate only"""
    limit: int | None = option(None, low=1, high=100000)
    """at most this many targets of each class"""
    search: SearchConfig = SearchConfig()
    adam: AdamOptions = AdamOptions()
    shape: Literal["known", "free"] = "known"
    """whether shapes such as cones are those that light.* says, or recovered, too"""
    poor_scene: bool = False
    """fit even where the scene was graded poor, and the answer is not to be trusted"""
    suggest_view: bool = False
    """say which further camera would help most, and how many views are needed"""
    wanted_accuracy: float = option(0.003, low=0, high=1)
    """with suggest_view: position error to reach, fraction of the scene's size"""
    landscape: bool = False
    """work out the loss on three planes through the first light, for evaluate to draw; half a minute a target"""
    exposure: Literal["known", "free"] = "known"
    """whether the images hold radiance, or every view but the first has an unknown factor, too"""
    clip: float | None = option(None, low=1e-12, high=1e12)
    """radiance at which images are clipped; by default 1 for 8-bit sRGB, else none"""
    emitters: Literal["auto", "off"] = "auto"
    """whether pixels of lamps that are in sight are looked for and left out; those of `emitter_path` always are"""
    targets: Literal["dataset", "generated"] = "dataset"
    """whose targets: the dataset's, or those that stage=generate_targets makes as targets.* says"""
    spot_basis: Literal["exact", "sh"] = "exact"
    """how a fit's model has spots: by their profile, or as the paper in spherical harmonics"""
    sh_degree: int = option(8, low=0, high=64)
    """with spot_basis=sh: the highest degree"""
    sh_mirrored: bool = True
    """with spot_basis=sh: light goes backwards as it does forwards, as in the paper"""
