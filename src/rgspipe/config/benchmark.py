"""What is timed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from rgspipe.benchmark.names import RoomName
from rgspipe.options import Options, option


@dataclass(frozen=True)
class BenchmarkConfig(Options):
    """What is measured."""

    kind: Literal["renderer", "fit", "search"] = "renderer"
    """the renderer on rooms with path-traced truth, the steps of a fit on the trained scene, or what each number that
    steers a search is worth: fits with it halved and doubled"""
    targets: int = option(4, low=1, high=1000)
    """with kind=search: single lights of each class; as many pairs and threes of unknown number; and a spot a light"""
    settings: tuple[str, ...] | None = None
    """with kind=search: which numbers of fit.search are halved and doubled, by name or by section (starts, bar.least,
    bar); by default all, and with [] none: targets are fitted as fit.search is, and no more"""
    repetitions: int = option(20, low=1, high=100000)
    """runs of each measured step"""
    rooms: tuple[RoomName, ...] = get_args(RoomName)
    """rooms that are path-traced and measured on"""
    truth_resolution: int = option(128, low=8, high=8192)
    """width and height of the path-traced images, pixels"""
    truth_samples: int = option(1024, low=8, high=1000000)
    """paths per pixel of the path-traced images with all bounces; a multiple of 8"""
