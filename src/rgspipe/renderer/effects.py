"""Which parts of light transport a frozen scene calls for: bounds on what each can change, and what it costs."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.frozen import FrozenScene

#: Lights at which shadows are sampled; half of them inside the bounding box, half in the ball around it.
SAMPLED_LIGHTS = 128

#: Radius of that ball over half the diagonal of the bounding box.
BALL_RADII = 2.0

#: Timed runs behind a saving.
RUNS = 5


@dataclass(frozen=True)
class EffectBounds:
    """What leaving an effect out can change, as a share of the brightest directly lit radiance in the scene.

    Attributes:
        interreflection: the largest ratio of indirect to brightest direct radiance, over all surfels, channels and
            all conceivable lights. With direct radiance D ≤ 1 the indirect part ρ F_p H R D is largest for D = 1, as
            every operator in it is non-negative: the bound is attained, not estimated.
        shadows: the largest unshadowed radiance that is lost to shadow, over SAMPLED_LIGHTS lights: sampled, so a
            shadow that only few positions cast can be missed.
        shadow_milliseconds, interreflection_milliseconds: what they cost in one evaluation with derivatives.
    """

    interreflection: float
    shadows: float
    shadow_milliseconds: float
    interreflection_milliseconds: float


@dataclass(frozen=True)
class EffectChoice:
    """The effects that are simulated, and a sentence for each that says why."""

    shadows: bool
    interreflection: bool
    reasons: tuple[str, str]


def measure_effects(frozen: FrozenScene, *, seed: int) -> EffectBounds:
    """Bounds for a frozen scene under one point light of any position and intensity."""
    ones = torch.ones(len(frozen.surfels), 3, 1, device=frozen.surfels.centers.device)
    positions = sample_lights(frozen, seed)
    irradiance, slope = frozen.unit_irradiance(positions[:1])
    lightings = torch.cat([irradiance.T, slope[0]], dim=1)
    with_shadows = _milliseconds(lambda: frozen.unit_irradiance(positions[:1]))
    without_shadows = _milliseconds(lambda: frozen.unit_irradiance(positions[:1], shadows=False))
    with_bounces = _milliseconds(lambda: frozen.radiance(lightings))
    without_bounces = _milliseconds(lambda: frozen.radiance(lightings, indirect=False))
    return EffectBounds(
        interreflection=float(frozen.transport.indirect(ones).amax()),
        shadows=_largest_shadow(frozen, positions),
        shadow_milliseconds=max(0.0, with_shadows - without_shadows),
        interreflection_milliseconds=max(0.0, with_bounces - without_bounces),
    )


def choose_effects(bounds: EffectBounds, tolerance: float) -> EffectChoice:
    """Leave out what cannot change the radiance anywhere by more than `tolerance` of the brightest direct radiance.

    Both effects together may use up the tolerance, so each gets half. A shadow that is left out also lights what its
    receiver lights: its bound is multiplied by 1 + interreflection.
    """
    allowed = 0.5 * tolerance
    bounces, shadow = bounds.interreflection, bounds.shadows * (1.0 + bounds.interreflection)
    reasons = (
        _reason("shadows", shadow, allowed, bounds.shadow_milliseconds),
        _reason("interreflection", bounces, allowed, bounds.interreflection_milliseconds),
    )
    return EffectChoice(shadow > allowed, bounces > allowed, reasons)


def sample_lights(frozen: FrozenScene, seed: int) -> Tensor:
    """(SAMPLED_LIGHTS, 3) positions, uniform in the bounding box and in the ball around it, half each."""
    generator = torch.Generator().manual_seed(seed)
    lower, upper = (corner.cpu() for corner in frozen.bounds)
    half = SAMPLED_LIGHTS // 2
    inside = lower + (upper - lower) * torch.rand(half, 3, generator=generator)
    direction = torch.nn.functional.normalize(torch.randn(half, 3, generator=generator), dim=1)
    radius = BALL_RADII * 0.5 * (upper - lower).norm() * torch.rand(half, 1, generator=generator).pow(1.0 / 3.0)
    return torch.cat([inside, 0.5 * (lower + upper) + radius * direction])


def _largest_shadow(frozen: FrozenScene, positions: Tensor) -> float:
    albedo = frozen.surfels.albedo.amax(dim=1)
    largest = 0.0
    for block in positions.split(16):
        lit, shadowed = (frozen.unit_irradiance(block, shadows=on)[0] * albedo for on in (False, True))
        peak = lit.amax(dim=1)
        lost = torch.where(peak > 0, (lit - shadowed).amax(dim=1) / peak.clamp(min=1e-30), torch.zeros_like(peak))
        largest = max(largest, float(lost.amax()))
    return largest


def _milliseconds(run: Callable[[], object]) -> float:
    run()
    times = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        run()
        times.append(1e3 * (time.perf_counter() - begin))
    return sorted(times)[RUNS // 2]


def _reason(effect: str, bound: float, allowed: float, milliseconds: float) -> str:
    if bound > allowed:
        return f"{effect} simulated: they can change {bound:.2g} of the brightest radiance (allowed {allowed:.2g})"
    return f"{effect} left out: at most {bound:.2g} of the brightest radiance, saves {milliseconds:.1f} ms a step"
