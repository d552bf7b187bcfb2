"""What steers the search for the lamps of a capture. Nothing here loads torch, for the command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.names import AlbedoPrior, Exposure
from rgspipe.options import Options, option


@dataclass(frozen=True)
class CaptureOptions(Options):
    """How lamps and albedo are found in photographs under lamps that nobody measured."""

    count: int | None = option(None, low=1, high=8)
    """how many lamps were on; found if null"""
    most: int = option(4, low=1, high=8)
    """most lamps that are looked for where their number is not known"""
    exposure: Exposure = "same"
    """whether all photographs were exposed alike, or each has its own exposure, or its own white balance, too, found by
    what they share"""
    vignetting: bool = False
    """whether photographs may be darker towards their corners, all alike, which is found by what they share"""
    response: Literal["known", "free"] = "known"
    """whether images of 8 or 16 bits were decoded by their camera's own curve, or that curve is found by photographs of
    exposures that are known and differ"""
    albedo_prior: AlbedoPrior = "none"
    """what is known of the albedo: nothing, or the albedo maps of the training views, from any method and up to a scale
    of each image"""
    unseen: bool = True
    """close rooms where no camera saw what is there"""
    gather_rays: int = option(512, low=8, high=65536)
    """hemisphere rays of a surfel: what surfaces send each other is measured, not fitted, so that noise of it stays"""
    supersampling: int = option(4, low=1, high=16)
    """rays per edge pixel in view weights, squared"""
    search_surfels: int = option(4000, low=100, high=10_000_000)
    """surfels, evenly spread, that lamps are looked for on where there are more; what is found is settled on all"""
    grid: int = option(8, low=2, high=32)
    """candidates for lamps along each axis"""
    memory_mib: float = option(4096.0, low=0, high=1e9)
    """memory [MiB] for what photographs see; what is beyond it is read from a file, with the same results"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of rays and candidates"""
