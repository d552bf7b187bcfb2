"""What steers training. Nothing here loads torch, so that the command line can show it at once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rgspipe.errors import InputError
from rgspipe.options import Options, option


@dataclass(frozen=True)
class MaterialOptions(Options):
    """How materials are fitted."""

    rounds: int = option(5, low=1, high=1000)
    """rounds of the linear albedo solve, before and after the geometry"""
    gather_rays: int = option(128, low=8, high=65536)
    """hemisphere rays of a surfel while training"""
    patches: int = option(500, low=8, high=20000)
    """patches of the indirect light while training"""
    supersampling: int = option(4, low=1, high=16)
    """rays per edge pixel in view weights, squared"""
    at_pixels: bool = True
    """direct light where pixels look, otherwise at surfels' centres: softer shadows"""
    gloss: Literal["none", "auto"] = "none"
    """none: every surface is diffuse; auto: surfels get a Phong lobe where it explains images it was not fitted to"""
    memory_mib: float = option(4096.0, low=0, high=1e9)
    """memory [MiB] for the training views' operators; those beyond it are read from a file, with the same results"""
    scratch: Path | None = None
    """folder of that file; by default the artifact's own, in Python the system's for temporary files"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of pixels, rays and patches"""


@dataclass(frozen=True)
class ImageLossOptions(Options):
    """What gradient steps minimise."""

    loss: Literal["l2", "l1", "l1_ssim"] = "l2"
    """what gradient steps minimise: squared or absolute errors, or (1 − λ)·L1 + λ·(1 − SSIM), which needs windows"""
    ssim_weight: float = option(0.2, low=0, high=1)
    """λ, the share of SSIM in the loss l1_ssim"""
    compression: float = option(0.0, low=0, high=1e6)
    """µ of the loss's compression log(1 + µx)/log(1 + µ) of radiance over its peak; 0 for none"""


@dataclass(frozen=True)
class RefineOptions(ImageLossOptions):
    """How geometry is refined."""

    steps: int = option(140, low=0, high=1000000)
    """gradient steps of the geometry"""
    views_per_step: int = option(5, low=1, high=1000)
    """images that a gradient step looks at"""
    edge_pixels: int = option(2000, low=1, high=10_000_000)
    """most pixels on edges, of each image of a step"""
    interior_pixels: int = option(1000, low=0, high=10_000_000)
    """most pixels elsewhere, of each image of a step; they close pinholes"""
    window: int = option(0, low=0, high=100000)
    """side of the windows of pixels that a step looks at; 0 for single pixels"""
    subsamples: int = option(3, low=1, high=16)
    """rays per pixel of a step, squared; in windows, of pixels on edges"""
    tilt_rate: float = option(0.0, low=0, high=1)
    """gradient step of normals, rad"""
    height_rate: float = option(0.0, low=0, high=1)
    """gradient step along normals, in surfel spacings"""
    alpha_weight: float = option(0.05, low=0, high=1e6)
    """weight of the difference between coverage and the images' alpha"""
    continuity_weight: float = option(0.0, low=0, high=1e6)
    """weight of normals that agree with positions"""
    smoothness_weight: float = option(0.0, low=0, high=1e6)
    """weight of neighbours' like normals"""
    distortion_weight: float = option(0.0, low=0, high=1e6)
    """weight of the spread of hits within a layer"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of pixels, rays and patches"""

    def check(self) -> None:
        """Refuse SSIM of pixels that stand alone."""
        if self.loss == "l1_ssim" and self.window == 0:
            raise InputError(
                "window",
                expected="the side of a window of pixels, as the loss l1_ssim compares windows",
                found="0: single pixels",
                remedy="Set it to 48, or take another loss.",
            )


@dataclass(frozen=True)
class TrainOptions(RefineOptions, MaterialOptions):
    """How surfels are trained: their materials, before and after the geometry, and the geometry."""

    photometric_rounds: int = option(1, low=0, high=100)
    """how often shading turns the normals of surfels that depth left rough; 0 for never"""
    relight_every: int = option(0, low=0, high=1000000)
    """gradient steps between which shadows and indirect light lag; 0 keeps those of the start"""
    growth: float = option(1.0, low=1, high=100)
    """most surfels after splits, which come with relight_every, over those before"""
    light_rounds: int = option(0, low=0, high=100)
    """how often each fit of materials refines the training lights; their mean stays"""
    unseen: bool = True
    """close rooms where no camera saw what is there: backs of boxes, floors behind them"""
