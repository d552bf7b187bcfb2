"""What real captures bring, put into clean training views: noise, holes, wrong lights, few views, no passes.

Every draw comes from the seed and the view's place in the full list, so that two captures that share a seed differ
only in what their options say, however many views they keep.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from scipy.ndimage import gaussian_filter
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.degradation.albedo_maps import with_predicted_albedo
from rgspipe.degradation.options import ViewErrors
from rgspipe.scene import PointLight, srgb

#: Read noise of an image, as a share of its relative noise and of the image's brightest values.
READ_NOISE = 0.1
#: Percentile of an image that stands for its brightest values.
BRIGHT = 0.995
#: Share of the missing depth pixels that lies in blobs, and the blobs' size over the image's width.
BLOB_SHARE, BLOB_SIZE = 0.5, 1.0 / 30.0


def degraded(views: Sequence[View], capture: ViewErrors) -> tuple[View, ...]:
    """The views as such a capture would have taken them; where nothing is asked for, the very same tensors.

    Missing depth is NaN: not known, as opposed to +inf, where there is no surface.
    """
    kept = range(len(views))
    if capture.views is not None and capture.views < len(views):
        kept = [round(place) for place in np.linspace(0, len(views) - 1, capture.views)]
    if capture.albedo_error > 0:
        views = with_predicted_albedo(views, capture.albedo_error, capture.seed)
    factors = exposures(len(views), capture.exposure, capture.seed)
    taken = tuple(_degrade(_exposed(views[index], factors[index]), capture, index) for index in kept)
    return taken if capture.white is None else _stored(taken, capture.white)


def _stored(views: tuple[View, ...], quantile: float) -> tuple[View, ...]:
    """In 8 bits, clipped at one radiance for all of them."""
    white = float(np.quantile(torch.cat([view.image.reshape(-1) for view in views]).double().numpy(), quantile))
    if not white > 0.0:
        return views
    return tuple(replace(view, image=eight_bit(view.image, white), saturated_from=white) for view in views)


def eight_bit(image: Tensor, white: float) -> Tensor:
    """The image, clipped to [0, white] and rounded to the 256 levels of sRGB."""
    encoded = srgb.encode((image.double() / white).clamp(0.0, 1.0).numpy())
    return torch.from_numpy(white * srgb.decode(np.round(255.0 * encoded) / 255.0)).to(image.dtype)


def exposures(count: int, stops: float, seed: int) -> list[float]:
    """A factor a view, of mean logarithm 0: what all have in common no photograph tells."""
    drawn = np.random.default_rng([seed, 4]).standard_normal(count)
    return np.exp2(stops * (drawn - drawn.mean())).tolist()


def _exposed(view: View, factor: float) -> View:
    return view if factor == 1.0 else replace(view, image=factor * view.image)


def _degrade(view: View, capture: ViewErrors, index: int) -> View:
    # One stream for each kind of draw: switching one on leaves the others as they are.
    depth_rng, hole_rng, image_rng, light_rng = (
        np.random.default_rng([capture.seed, index, kind]) for kind in range(4)
    )
    depth = view.depth
    if depth is not None and capture.depth_noise > 0:
        depth = depth * torch.from_numpy(_positive_noise(depth.shape, capture.depth_noise, depth_rng)).to(depth.dtype)
    if depth is not None and capture.depth_missing > 0:
        holes = torch.from_numpy(_holes(depth.shape, capture.depth_missing, hole_rng))
        depth = torch.where(holes, torch.nan, depth)
    image = view.image
    if capture.image_noise > 0:
        image = _noisy_image(view, capture.image_noise, image_rng)
    return replace(
        view,
        image=image,
        depth=depth,
        light=_moved(view.light, capture, light_rng),
        normal=view.normal if capture.normals else None,
        albedo=view.albedo if capture.albedo else None,
    )


def _positive_noise(shape: Sequence[int], deviation: float, rng: np.random.Generator) -> np.ndarray:
    """Factors 1 + deviation · standard normal, kept positive: a depth of zero or less is no measurement."""
    return np.maximum(1.0 + deviation * rng.standard_normal(shape), 0.05)


def _holes(shape: Sequence[int], share: float, rng: np.random.Generator) -> np.ndarray:
    """(H, W) mask with exactly `share` of the pixels (rounded), part of them where a smooth random field is high."""
    size = int(np.prod(shape))
    total, in_blobs = round(share * size), round(BLOB_SHARE * share * size)
    field = gaussian_filter(rng.standard_normal(shape), BLOB_SIZE * shape[1], mode="wrap").reshape(-1)
    order = np.argsort(-field, kind="stable")
    single = rng.permutation(order[in_blobs:])[: total - in_blobs]
    mask = np.zeros(size, dtype=bool)
    mask[order[:in_blobs]] = True
    mask[single] = True
    return mask.reshape(tuple(shape))


def _noisy_image(view: View, deviation: float, rng: np.random.Generator) -> Tensor:
    """Noise on the radiance; nothing outside of the alpha mask."""
    normal = torch.from_numpy(rng.standard_normal(tuple(view.image.shape)))
    noise = noise_deviation(view.image, deviation) * normal
    return (view.image.double() + noise * view.alpha[..., None]).to(view.image.dtype)


def noise_deviation(image: Tensor, relative: float) -> Tensor:
    """(H, W, 3) float64 deviation of each value's noise, `relative` · √(value² + (READ_NOISE · brightest)²)."""
    values = image.double()
    bright = READ_NOISE * torch.quantile(values.reshape(-1), BRIGHT)
    return relative * torch.sqrt(values.square() + bright.square())


def _moved(light: PointLight | None, capture: ViewErrors, rng: np.random.Generator) -> PointLight | None:
    """The light where, and as bright as, the capture believes it to be."""
    if light is None or (capture.light_position_noise == 0 and capture.light_intensity_noise == 0):
        return light
    shift, gain = rng.standard_normal(3), rng.standard_normal()
    return PointLight(
        light.position + capture.light_position_noise * torch.from_numpy(shift).to(light.position),
        light.intensity * float(np.exp(capture.light_intensity_noise * gain)),
    )
