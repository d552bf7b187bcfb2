"""What each part of light transport can change in a frozen scene, bounded, and what it costs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import torch

from rgspipe.machine.device import finish
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.glossy import largest_lobe
from rgspipe.renderer.shadow_bound import ShadowBound, shadow_bound
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.lights import PointLight, SpotLight

#: Bounds end here: no tolerance is as large, and JSON knows no infinity.
NO_BOUND = 1e6

#: Timed runs behind a cost, of which the fastest counts.
RUNS = 3


@dataclass(frozen=True)
class EffectBounds:
    """What leaving an effect out can change, as a share of the brightest direct radiance: diffuse, without shadows.

    Attributes:
        interreflection: the largest ratio of indirect to brightest direct radiance, over all surfels, channels and
            lights. With D ≤ 1 the indirect part ρ F_p H R D is largest for D = 1, as every operator in it is
            non-negative: in a diffuse scene the bound is attained.
        row_sum: σ, the largest row sum of ρF, of all channels: every bounce keeps at most this share, so that what is
            left after b bounces is at most σ^(b+1)/(1 − σ).
        shadows: of one light.
        specular: the largest radiance of the specular lobes, highlights and reflections; 0 for a diffuse scene.
    """

    interreflection: float
    row_sum: float
    shadows: ShadowBound
    specular: float

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> EffectBounds:
        """The bounds whose `asdict` was written."""
        return cls(**{**values, "shadows": ShadowBound(**values["shadows"])})


def measure_effects(frozen: FrozenScene, *, seed: int) -> EffectBounds:
    """Bounds for a frozen scene under lights of any intensity, anywhere in the ball of `shadow_bound.BALL_RADII`.

    With specular reflectance k_s, s_i = (F 1)_i the share of its hemisphere in which surfel i sees others (all of it
    counts for a lobe as soon as s_i > 0), and q = max_i (ρ_i s_i + k_s,i [s_i > 0]), radiance V in any direction obeys
    V ≤ (1 + λ) D + q V, where λ = max largest_lobe_i/ρ_i as D ≥ ρ_i E_i/π. So indirect light is at most q V, and lobes
    change radiance by at most (λ + k_s (1 + b))/(1 − q), b the bound on diffuse interreflection; nothing is known for
    q ≥ 1. The ringing of truncated harmonics is not part of it.
    """
    surfels, transport = frozen.surfels, frozen.transport
    dark = transport.gather.entries == 0
    ones = torch.ones(len(surfels), 3, 1, device=surfels.centers.device)
    bounced = 0.0 if dark else float(transport.indirect(ones).amax())
    seen = torch.zeros_like(ones[:, :, 0]) if dark else transport.gather @ ones[: transport.gather.shape[1], :, 0]
    row_sum = float((surfels.albedo * seen).amax()) if len(surfels) else 0.0
    specular = 0.0
    if frozen.gloss is not None:
        reflectance, brightest = surfels.gloss.reflectance, surfels.albedo.amax(dim=1)
        highlight = float((largest_lobe(surfels.gloss) / brightest.clamp(min=1e-30)).amax())
        kept = float((surfels.albedo * seen + reflectance * (seen > 0.0)).amax())
        specular = _at_most(highlight + float(reflectance.amax()) * (1.0 + bounced), 1.0 - kept)
        bounced = max(bounced, _at_most(kept * (1.0 + highlight), 1.0 - kept))
    return EffectBounds(bounced, row_sum, shadow_bound(frozen, seed), specular)


def bounces_needed(row_sum: float, tolerance: float) -> int | None:
    """Bounces after which the rest is at most `tolerance` of the brightest direct radiance; None if that is not known.

    Solves σ^(b+1)/(1 − σ) ≤ tolerance, for solvers that bounce one by one: with the inverse of the patch transport all
    bounces cost what one costs.
    """
    if row_sum <= 0.0:
        return 0
    if row_sum >= 1.0 or tolerance <= 0.0:
        return None
    return max(0, math.ceil(math.log(tolerance * (1.0 - row_sum)) / math.log(row_sum) - 1e-9) - 1)


def void_share(views: list[ViewWeights]) -> float:
    """The largest share of a pixel that sees past the scene: an image's alpha is within this of 1 everywhere.

    Images are W B, so a background is never added up in a step; alpha is W 1 and wanted only where this is not zero.
    """
    return max((float((1.0 - view.coverage).amax()) for view in views), default=0.0)


def measure_costs(frozen: FrozenScene) -> dict[str, float]:
    """Milliseconds that each effect adds to one evaluation with derivatives, under one light; see `EffectChoice`."""
    position = 0.5 * (frozen.bounds[0] + frozen.bounds[1]) + 0.1 * frozen.size
    ones, axis = torch.ones(3), torch.tensor([0.0, 0.0, -1.0])
    spot = (SpotLight(position.cpu(), ones, axis, "gaussian", 0.5, 0.2),)
    point = (PointLight(position.cpu(), ones),)
    lightings = torch.ones(len(frozen.surfels), 4, device=frozen.surfels.centers.device)
    dark = Effects(shadows=False, interreflection=False, lobes=False)
    pairs = {
        "shadows": (lambda on: frozen.unit_irradiance(position[None], shadows=on)),
        "interreflection": (lambda on: frozen.radiance(lightings, indirect=on)),
        "spot cones": (lambda on: frozen.radiance_of(spot, replace(dark, cones=on))),
    }
    if frozen.gloss is not None:
        pairs["specular lobes"] = lambda on: frozen.radiance_of(point, Effects(shadows=False, lobes=on))
    device = frozen.device
    return {
        name: max(0.0, _milliseconds(run, True, device) - _milliseconds(run, False, device))
        for name, run in pairs.items()
    }


def _at_most(numerator: float, denominator: float) -> float:
    return min(NO_BOUND, numerator / denominator) if denominator > 0.0 else NO_BOUND


def _milliseconds(run: Callable[[bool], object], on: bool, device: torch.device) -> float:
    run(on)
    finish(device)
    times = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        run(on)
        finish(device)
        times.append(1e3 * (time.perf_counter() - begin))
    return min(times)
