"""Training lights that were measured with errors: positions and intensities that explain the images better.

Given the surfels as they stand, every view tells its own light: six unknowns, thousands of pixels. All views share
the surfels, so what each light is wrong by averages out of the materials, and materials and lights are fitted in turns.

Gauge. Twice the intensity of every light and half of every albedo leave direct light as it is, and only light that
bounces, which is modelled least well, tells them apart; a shift of all lights is told mostly by what the model is
biased by. Errors of measurement are independent, so their mean over V views is √V times smaller than one of them:
the mean correction of positions and that of log-intensities are taken out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.optim.levenberg_marquardt import NormalEquations, least_squares, within
from rgspipe.progress import progress_bar
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import PixelDirect, surfel_transmittance
from rgspipe.renderer.transport import PatchTransport
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.lights import PointLight
from rgspipe.training.levels import peak
from rgspipe.training.photographs import relative, trusted

#: Steps of a light; each at most so long, in scene sizes and in log-intensity.
STEPS, LONGEST, STRONGEST = 4, 0.03, 0.2

#: Relative error, in medians of all pixels, from which on a pixel counts less (Cauchy).
OUTLIER = 3.0


def refine_lights(
    bvh: SurfelBvh,
    weights: Sequence[ViewWeights],
    transport: PatchTransport,
    views: Sequence[View],
    measured: Sequence[PointLight],
) -> list[View]:
    """The views with lights that explain their images better, under the gauge above.

    Args:
        bvh: N surfels.
        weights: view weights of the V views.
        transport: light between the surfels, with their albedo.
        views: their lights are where the search starts.
        measured: V lights that corrections count from.
    """
    pairs = zip(views, weights, strict=True)
    found = [_OneLight(bvh, weight, transport, view).refined() for view, weight in progress_bar(list(pairs), "lights")]
    return [replace(view, light=light) for view, light in zip(views, in_gauge(found, measured), strict=True)]


def log_gains(lights: Sequence[PointLight], measured: Sequence[PointLight]) -> Tensor:
    """(V, 3) logarithm of the intensities of lights over the measured ones; NaN in colours that one does not have."""
    pairs = zip(lights, measured, strict=True)
    gains = torch.stack([(light.intensity / given.intensity).log() for light, given in pairs])
    return torch.where(gains.isfinite(), gains, torch.nan)


def in_gauge(lights: Sequence[PointLight], measured: Sequence[PointLight]) -> list[PointLight]:
    """`lights` without their mean difference from the measured ones."""
    shift = torch.stack([a.position - b.position for a, b in zip(lights, measured, strict=True)]).mean(dim=0)
    gain = log_gains(lights, measured).nanmean(dim=0).nan_to_num()
    return [PointLight(light.position - shift, light.intensity * (-gain).exp()) for light in lights]


@dataclass(frozen=True)
class _Seen:
    """A light, and `unit` (P, 3, 4): the image of one of 1 W/sr in its place, and its derivative towards x, y and z."""

    light: PointLight
    unit: Tensor

    @property
    def image(self) -> Tensor:
        """(P, 3)."""
        return self.unit[:, :, 0] * self.light.intensity.to(self.unit)


class _OneLight:
    """The light of one view as the unknown of a robust least-squares problem."""

    def __init__(self, bvh: SurfelBvh, weight: ViewWeights, transport: PatchTransport, view: View) -> None:
        self._bvh, self._weight, self._transport = bvh, weight, transport
        self._direct = PixelDirect(bvh, weight)
        self.image = view.image.reshape(-1, 3).float()
        centers = bvh.surfels.centers
        self.size = float((centers.amax(dim=0) - centers.amin(dim=0)).amax())
        self.start = self.seen(PointLight(view.light.position.double(), view.light.intensity.double()))
        inside = torch.where(weight.edges, torch.zeros(()), trusted(view, weight.coverage))
        trust = inside * relative(self.start.image, peak(self.image))
        self.weights = self._robust(trust) if bool((trust > 0.0).any()) else trust

    def refined(self) -> PointLight:
        """The light after a few steps, each of which lowers the cost."""
        return least_squares(self, self.start, STEPS).value.light

    def around(self, seen: _Seen) -> _AroundLight:
        return _AroundLight(self, seen)

    def seen(self, light: PointLight) -> _Seen:
        return _Seen(light, self._unit_image(light.position))

    def cost(self, seen: _Seen) -> float:
        residual = seen.image - self.image
        return float((self.weights[:, None] * residual.square()).sum(dtype=torch.float64))

    def _robust(self, trust: Tensor) -> Tensor:
        """`trust` (P,), less in pixels that fit badly under the first light."""
        error = (self.start.image - self.image).abs().mean(dim=1)
        relative = error * trust.sqrt()
        typical = OUTLIER * relative[trust > 0.0].median() + 1e-12
        return trust / (1.0 + (relative / typical).square())

    def _unit_image(self, position: Tensor) -> Tensor:
        """(P, 3, 4) image of a light of 1 W/sr with all bounces, and its derivative towards x, y and z."""
        passing, slope = surfel_transmittance(self._bvh, position)
        image = self._direct.image(position, passing, slope)
        irradiance, gradient = unit_irradiance(self._bvh, position[None])
        columns = torch.cat([irradiance[0, :, None], gradient[0]], dim=1) / math.pi
        albedo = self._transport.albedo
        bounced = self._transport.indirect(albedo[:, :, None] * columns[:, None, :])
        return image + (self._weight.operator @ bounced.reshape(len(albedo), 12)).reshape(-1, 3, 4)


@dataclass(frozen=True)
class _AroundLight:
    """The problem around a light; parameters are its position over the scene's size and its log-intensity."""

    view: _OneLight
    seen: _Seen

    @cached_property
    def normal(self) -> NormalEquations:
        view, seen = self.view, self.seen
        by_position = view.size * seen.unit[:, :, 1:] * seen.light.intensity.to(seen.unit)[:, None]
        jacobian = torch.cat([by_position, torch.diag_embed(seen.image)], dim=2).double()
        weighted = jacobian * view.weights[:, None, None]
        matrix = torch.einsum("pck,pcl->kl", weighted, jacobian)
        direction = torch.einsum("pck,pc->k", weighted, (view.image - seen.image).double())
        return NormalEquations(matrix.cpu(), direction.cpu(), view.cost(seen))

    def allowed(self, step: Tensor) -> float:
        return min(within(float(step[:3].norm()), LONGEST), within(float(step[3:].abs().max()), STRONGEST))

    def moved(self, step: Tensor) -> PointLight:
        light = self.seen.light
        return PointLight(light.position + self.view.size * step[:3], light.intensity * step[3:].exp())

    def distance(self, light: PointLight) -> float:
        before = self.seen.light
        brightened = (light.intensity - before.intensity).abs() / before.intensity.clamp(min=1e-300)
        return max(float((light.position - before.position).norm()) / self.view.size, float(brightened.max()))

    def evaluated(self, light: PointLight) -> tuple[float, _Seen]:
        seen = self.view.seen(light)
        return self.view.cost(seen), seen
