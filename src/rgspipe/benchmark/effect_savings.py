"""What `effects=auto` decides on each scene, how far its images are from those with all effects, and what it saves."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable

import pandas as pd
import torch

from rgspipe.benchmark.effect_scenes import EffectScene
from rgspipe.evaluation.timing import median_ms
from rgspipe.renderer.effect_bounds import EffectBounds, measure_effects
from rgspipe.renderer.effect_choice import RigKind, choose_effects
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.shadow_bound import sample_lights, shadow_losses
from rgspipe.scene import LightRig, PointLight

#: Timed images with each set of effects, of which the fastest counts.
RUNS = 5


def effect_savings(
    scenes: Iterable[EffectScene],
    lights: int,
    tolerance: float,
    *,
    surfels: int = 3000,
    gather_rays: int = 64,
    patches: int = 200,
    resolution: int = 64,
    seed: int = 0,
) -> pd.DataFrame:
    """Images with the chosen effects against images with all of them, under rigs that the choice has not seen.

    Args:
        scenes: what is rendered.
        lights: rigs for each scene, positions drawn from the domain of the bounds, intensities over two orders of
            magnitude, spots aimed at surfels.
        tolerance: of the choice.
        surfels: about so many in each scene; gather_rays, patches: of its frozen form.
        resolution: of the square images.

    Returns:
        One row a scene: the rig, each effect's bound and decision with its reason, `difference` (the largest of an
        image, as a share of the brightest direct radiance, over `tolerance`: at most 1), `missed` (share of held-out
        lights that lose more to shadow than the bound says, before its margin), milliseconds of the measurement and of
        an image with all and with the chosen effects.
    """
    options = {"gather_rays": gather_rays, "patches": patches, "seed": seed}
    rows = [
        _row(scene, FrozenScene.freeze(scene.build(surfels), **options), lights, tolerance, resolution, seed)
        for scene in scenes
    ]
    return pd.DataFrame(rows)


def _row(
    scene: EffectScene, frozen: FrozenScene, lights: int, tolerance: float, resolution: int, seed: int
) -> dict[str, object]:
    begin = time.perf_counter()
    bounds = measure_effects(frozen, seed=seed)
    measured = 1e3 * (time.perf_counter() - begin)
    choice = choose_effects(
        bounds, tolerance, RigKind(scene.points, tuple(spot.least_relative_intensity for spot in scene.spots))
    )
    effects, view = choice.effects, frozen.view(scene.camera(resolution))
    generator = torch.Generator().manual_seed(seed + 1)
    rigs = [random_rig(scene, frozen, generator) for _ in range(lights)]
    differences = [
        float((frozen.render(view, rig, sharp=False) - frozen.render(view, rig, effects, sharp=False)).abs().max())
        / brightest_direct(frozen, rig)
        for rig in rigs
    ]
    row: dict[str, object] = {"scene": scene.name, "surfels": len(frozen.surfels)}
    row |= {"rig": f"{scene.points} point, {len(scene.spots)} spot"}
    for decision in choice.decisions:
        row |= {decision.effect: decision.simulated, f"{decision.effect} bound": decision.bound}
    return row | {
        "reasons": "; ".join(choice.reasons),
        "difference": max(differences) / tolerance,
        "missed": _missed(frozen, bounds, lights, generator),
        "measurement_ms": measured,
        "all_ms": median_ms(lambda: frozen.render(view, rigs[0], sharp=False), RUNS),
        "chosen_ms": median_ms(lambda: frozen.render(view, rigs[0], effects, sharp=False), RUNS),
    }


def random_rig(scene: EffectScene, frozen: FrozenScene, generator: torch.Generator) -> LightRig:
    """A rig of the scene's kind, anywhere in the domain of the bounds."""
    count = scene.points + len(scene.spots)
    positions = sample_lights(frozen, count, generator)
    intensities = 10.0 ** (2.0 * torch.rand(count, 3, generator=generator) - 1.0)
    aims = frozen.surfels.centers.to(positions)[torch.randint(len(frozen.surfels), (count,), generator=generator)]
    axes = torch.nn.functional.normalize(aims - positions, dim=1)
    points = [PointLight(positions[k], intensities[k]) for k in range(scene.points)]
    spots = [shape.at(positions[k], axes[k], intensities[k]) for k, shape in enumerate(scene.spots, start=scene.points)]
    return (*points, *spots)


def brightest_direct(frozen: FrozenScene, rig: LightRig) -> float:
    """The largest diffuse radiance of a surfel under a rig, without shadows and bounces; infinite if all is dark."""
    dark = Effects(shadows=False, interreflection=False, lobes=False)
    return float(frozen.radiance_of(rig, dark).max()) or math.inf


def _missed(frozen: FrozenScene, bounds: EffectBounds, lights: int, generator: torch.Generator) -> float:
    positions = sample_lights(frozen, lights, generator)
    worst = torch.cat([shadow_losses(frozen, block)[0] for block in positions.split(16)])
    # Half is as good as all: nobody tolerates as much, and the search ends there.
    return float((worst.clamp(max=0.5) > bounds.shadows.point * (1.0 + 1e-5) + 1e-7).float().mean())
