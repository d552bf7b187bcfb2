"""How cost grows with the number of surfels: time of each part, memory of the operators, peak while building."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import pandas as pd
import torch

from rgspipe.benchmark.rooms import Room
from rgspipe.evaluation.timing import measure
from rgspipe.machine.description import peak_memory_now_mib, reset_peak_memory
from rgspipe.progress import progress_bar
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.transport import build_patch_transport
from rgspipe.renderer.view_weights import build_view_weights
from rgspipe.scene.rectangles import surfels_on

Made = TypeVar("Made")

#: Numbers of surfels.
COUNTS = (2_500, 5_000, 10_000, 20_000, 50_000, 100_000, 200_000)

#: Rays and patches of the operators: few, so that 200 000 surfels fit into a laptop's memory.
GATHER_RAYS, PATCHES = 32, 500


def scaling(room: Room, counts: tuple[int, ...] = COUNTS, repetitions: int = 5) -> pd.DataFrame:
    """One row per number of surfels and part: `surfels`, `part`, `ms`, `operators_mib`, `peak_mib`."""
    rows = []
    for count in progress_bar(counts, f"scaling, {room.name}", unit="size"):
        rows += _parts(room, count, repetitions)
    return pd.DataFrame(rows)


def _parts(room: Room, count: int, repetitions: int) -> list[dict[str, object]]:
    surfels = surfels_on(room.surfaces, count).to(torch.float32)
    light, camera = room.lights[:1].float(), room.cameras(128)[0]
    reset_peak_memory()
    parts: dict[str, float] = {}
    bvh = _timed(parts, "hierarchy", lambda: SurfelBvh(surfels))
    gather = _timed(parts, f"gather, {GATHER_RAYS} rays", lambda: build_gather(bvh, GATHER_RAYS, seed=0))
    areas = surfels.scales.prod(dim=1)
    transport = _timed(
        parts,
        f"patch transport, {PATCHES} patches",
        lambda: build_patch_transport(
            gather, cluster_patches(surfels.centers, surfels.normals, PATCHES, seed=0), areas, surfels.albedo
        ),
    )
    build_view_weights(bvh, camera)
    view = _timed(parts, "view weights, 128²", lambda: build_view_weights(bvh, camera))
    parts["irradiance and derivative"] = measure(
        "irradiance", lambda: unit_irradiance(bvh, light), repetitions
    ).median_ms
    operators = (gather, transport.average, transport.gather, view.operator)
    size = 8 * sum(operator.entries for operator in operators) + 4 * transport.inverse.numel()
    shared = {"operators_mib": size / 2**20, "peak_mib": peak_memory_now_mib()}
    return [{"surfels": len(surfels), "part": part, "ms": ms} | shared for part, ms in parts.items()]


def _timed(parts: dict[str, float], name: str, make: Callable[[], Made]) -> Made:
    begin = time.perf_counter()
    made = make()
    parts[name] = 1e3 * (time.perf_counter() - begin)
    return made
