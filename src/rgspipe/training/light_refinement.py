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

import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.progress import track
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import PixelDirect, surfel_shares
from rgspipe.renderer.transport import PatchTransport
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.lights import PointLight
from rgspipe.training.albedo import pixel_weight

#: Gauss-Newton steps of a light; each at most so long, in scene sizes and in log-intensity.
STEPS, LONGEST, STRONGEST = 4, 0.03, 0.2

#: Halvings of a step that does not lower the cost before the light is left where it is.
HALVINGS = 4

#: Relative error, in medians of all pixels, from which on a pixel counts less (Cauchy).
OUTLIER = 3.0

#: Added to the diagonal of the normal equations, as a part of it.
RIDGE = 1e-6


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
    found = [_OneLight(bvh, weight, transport, view).refined() for view, weight in track(list(pairs), "lights")]
    return [replace(view, light=light) for view, light in zip(views, _in_gauge(found, measured), strict=True)]


def _in_gauge(lights: Sequence[PointLight], measured: Sequence[PointLight]) -> list[PointLight]:
    """`lights` without their mean difference from the measured ones."""
    shift = torch.stack([a.position - b.position for a, b in zip(lights, measured, strict=True)]).mean(dim=0)
    gain = torch.stack([(a.intensity / b.intensity).log() for a, b in zip(lights, measured, strict=True)]).mean(dim=0)
    return [PointLight(light.position - shift, light.intensity * (-gain).exp()) for light in lights]


@dataclass(frozen=True)
class _Fit:
    """A light, its cost, and the Gauss-Newton step from it (6,): position, then log-intensity."""

    light: PointLight
    cost: float
    step: Tensor


class _OneLight:
    """The light of one view as the unknown of a robust least-squares problem."""

    def __init__(self, bvh: SurfelBvh, weight: ViewWeights, transport: PatchTransport, view: View) -> None:
        self._bvh, self._weight, self._transport, self._view = bvh, weight, transport, view
        self._direct = PixelDirect(bvh, weight)
        self._image = view.image.reshape(-1, 3).float()
        self._trust = torch.where(weight.edges, torch.zeros(()), pixel_weight(view, weight.coverage))
        centers = bvh.surfels.centers
        self._size = float((centers.amax(dim=0) - centers.amin(dim=0)).amax())

    def refined(self) -> PointLight:
        """The light after a few Gauss-Newton steps, each of which lowers the cost."""
        light = PointLight(self._view.light.position.double(), self._view.light.intensity.double())
        if not bool((self._trust > 0.0).any()):
            return light
        pixels = self._trust * self._robust(light)
        current = self._fit(light, pixels)
        for _ in range(STEPS):
            better = self._searched(current, pixels)
            if better is None:
                break
            current = better
        return current.light

    def _searched(self, current: _Fit, pixels: Tensor) -> _Fit | None:
        """The first of ever shorter steps that lowers the cost."""
        for halving in range(HALVINGS):
            step = 0.5**halving * current.step
            moved = PointLight(current.light.position + step[:3], current.light.intensity * step[3:].exp())
            candidate = self._fit(moved, pixels)
            if candidate.cost < current.cost:
                return candidate
        return None

    def _fit(self, light: PointLight, pixels: Tensor) -> _Fit:
        unit = self._unit_image(light.position)
        intensity = light.intensity.float()
        residual = unit[:, :, 0] * intensity - self._image
        by_position = unit[:, :, 1:] * intensity[:, None]
        by_gain = torch.diag_embed(unit[:, :, 0] * intensity)
        jacobian = torch.cat([by_position, by_gain], dim=2).double()
        weighted = jacobian * pixels[:, None, None]
        normal = torch.einsum("pck,pcl->kl", weighted, jacobian)
        right = torch.einsum("pck,pc->k", weighted, residual.double())
        ridge = torch.diag(RIDGE * normal.diagonal() + 1e-30)
        step = -torch.linalg.solve(normal + ridge, right)
        cost = float((pixels[:, None] * residual.square()).sum(dtype=torch.float64))
        return _Fit(light, cost, _shortened(step, LONGEST * self._size))

    def _robust(self, light: PointLight) -> Tensor:
        """(P,) in (0, 1]: how far pixels that fit badly under the first light are trusted."""
        error = (self._unit_image(light.position)[:, :, 0] * light.intensity.float() - self._image).abs().mean(dim=1)
        relative = error * self._trust.sqrt()
        typical = OUTLIER * relative[self._trust > 0.0].median() + 1e-12
        return 1.0 / (1.0 + (relative / typical).square())

    def _unit_image(self, position: Tensor) -> Tensor:
        """(P, 3, 4) image of a light of 1 W/sr with all bounces, and its derivative towards x, y and z."""
        share, slope = surfel_shares(self._bvh, position)
        image = self._direct.image(position, share, slope)
        irradiance, gradient = unit_irradiance(self._bvh, position[None])
        columns = torch.cat([irradiance[0, :, None], gradient[0]], dim=1) / math.pi
        albedo = self._transport.albedo
        bounced = self._transport.indirect(albedo[:, :, None] * columns[:, None, :])
        return image + (self._weight.operator @ bounced.reshape(len(albedo), 12)).reshape(-1, 3, 4)


def _shortened(step: Tensor, longest: float) -> Tensor:
    """A step (6,) of at most `longest` in position and STRONGEST in any log-intensity, in the same direction."""
    excess = torch.maximum(step[:3].norm() / longest, step[3:].abs().amax() / STRONGEST)
    return step / excess.clamp(min=1.0)
