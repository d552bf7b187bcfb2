"""How far data are from perfect; all defaults change nothing. Nothing here loads torch."""

from __future__ import annotations

from dataclasses import dataclass, replace

from rgspipe.options import Options, option


@dataclass(frozen=True)
class ViewErrors(Options):
    """Errors of a real capture, put into the training views; held-out views and targets stay clean."""

    depth_noise: float = option(0.0, low=0, high=1)
    """depth: standard deviation in every pixel over the depth"""
    depth_missing: float = option(0.0, low=0, high=0.99)
    """depth: share of unknown pixels (NaN), half of them in blobs"""
    image_noise: float = option(0.0, low=0, high=10)
    """images: standard deviation over the value, and a tenth of it over the brightest value, in the dark, too"""
    light_position_noise: float = option(0.0, low=0, high=10)
    """lights: standard deviation of a coordinate, scene units"""
    light_intensity_noise: float = option(0.0, low=0, high=10)
    """lights: standard deviation of the log-intensity, all channels alike"""
    exposure: float = option(0.0, low=0, high=10)
    """images: standard deviation of each one's exposure about the mean of all, in stops (factors of two)"""
    white: float | None = option(None, low=0.01, high=1)
    """8-bit sRGB images that clip what is above this quantile of all values; by default floating point"""
    albedo_error: float = option(0.0, low=0, high=2)
    """albedo maps: standard deviation of the log-error, smooth over 0.15 of the scene and alike in all images, and that
    of each image's own scale"""
    views: int | None = option(None, low=1, high=100000)
    """keep so many views, spread evenly"""
    normals: bool = True
    """keep the normal pass"""
    albedo: bool = True
    """keep the albedo pass"""
    seed: int = option(0, low=0, high=2**32 - 1)
    """draws of the errors"""


@dataclass(frozen=True)
class TargetErrors(Options):
    """Errors of a real camera, put into the images of fit targets."""

    noise: float = option(0.0, low=0, high=10)
    """standard deviation over the value, and a tenth of it over the brightest value"""
    exposure: float = option(0.0, low=0, high=10)
    """standard deviation of the exposure of every view but the first, in stops (factors of two)"""
    white: float | None = option(None, low=0.01, high=1)
    """8-bit sRGB images that clip what is above this quantile of the target's values; by default floating point"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of the errors"""


@dataclass(frozen=True)
class ModelError(Options):
    """Errors put into the scene that is frozen, to measure what they cost a fit."""

    albedo: float = option(0.0, low=0, high=2)
    """albedo: standard deviation of the log-error, smooth over 0.15 of the scene, different in each channel"""
    albedo_factor: float = option(1.0, low=0.01, high=100)
    """albedo: factor on all of it"""
    position: float = option(0.0, low=0, high=0.5)
    """surfels: standard deviation of a shift along the normal, parts of the scene's size"""
    tilt: float = option(0.0, low=0, high=60)
    """normals: standard deviation of a turn about each of two axes, degrees"""
    missing: tuple[float, float, float, float, float, float] | None = option(None, low=-1e6, high=1e6)
    """a missing object: box [x,y,z,x,y,z], lower and upper corner, without surfels, scene units"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of the errors"""

    @property
    def none(self) -> bool:
        """Whether nothing is changed."""
        return replace(self, seed=0) == ModelError()
