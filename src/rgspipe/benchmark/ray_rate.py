"""Rays per second of our kernels beside Embree's, and memory traffic of the products beside a copy's."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from rgspipe.benchmark.mitsuba_process import PeerMissing, ask_mitsuba
from rgspipe.evaluation.timing import median_ms
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.launch import thread_count
from rgspipe.renderer.kernels.receiver import RECEIVER_SKIP
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, footprint_reach
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene import Camera
from rgspipe.scene.surfels import Surfels

#: Floats of the array whose copy is timed: far more than any cache holds.
COPIED = 2**26

#: Bytes of an entry of a sparse matrix: a float32 and an int32.
ENTRY_BYTES = 8


def footprint_quads(surfels: Surfels) -> Tensor:
    """(N, 4, 3) corners of the rectangle around each footprint; clips are not cut off."""
    axes = surfels.frames[:, :2] * (surfels.scales * footprint_reach(surfels).sqrt()[:, None])[:, :, None]
    u, v = axes.unbind(1)
    return torch.stack([surfels.centers + s * u + t * v for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))], dim=1)


def ray_rates(surfels: Surfels, lights: Tensor, camera: Camera, repetitions: int) -> pd.DataFrame:
    """Rates of shadow rays (surfels to lights) and camera rays (pixel centres), ours and Embree's, in one run.

    Ours blend every surfel on their way, clipped and Gaussian, and shadow rays return a derivative; Embree's stop
    at the first rectangle. Both are given the same rays and all cores.

    Args:
        surfels: N, any floating dtype.
        lights: (L, 3).
        camera: whose pixels' centres rays go through.
        repetitions: of each timing.

    Returns:
        `rays` ("shadow" or "camera"), `caster`, `count`, `ms`, `mrays_per_s`, `over_embree` (our rate over Embree's)
        and `note`, which says why Embree's figures are missing where they are.
    """
    surfels = surfels.to(torch.float32)
    bvh = SurfelBvh(surfels)
    origins, paths = shadow_rays(surfels, lights.float())
    eye, directions, _ = camera.rays()
    ours = {
        "shadow": median_ms(lambda: unit_irradiance(bvh, lights), repetitions),
        "camera": median_ms(lambda: composite(bvh, eye, directions), repetitions),
    }
    arrays = {"quads": footprint_quads(surfels).numpy(), "occluded_origins": origins.numpy()}
    arrays |= {
        "occluded_paths": paths.numpy(),
        "nearest_origins": eye.numpy(),
        "nearest_directions": directions.numpy(),
    }
    try:
        figures, _ = ask_mitsuba("rays", arrays, repetitions=repetitions)
        embree = {"shadow": figures["occluded_ms"], "camera": figures["nearest_ms"]}
        note = f"{figures['threads']} threads, {100 * figures['occluded_share']:.0f} % of shadow rays blocked"
    except PeerMissing as missing:
        embree, note = dict.fromkeys(ours, np.nan), str(missing)
    rows = []
    for rays, count in (("shadow", len(origins)), ("camera", len(directions))):
        rows.append(_row(rays, "rgspipe", count, ours[rays], embree[rays] / ours[rays], f"{thread_count()} threads"))
        rows.append(_row(rays, "Embree, through Mitsuba", count, embree[rays], 1.0, note))
    return pd.DataFrame(rows)


def shadow_rays(surfels: Surfels, lights: Tensor) -> tuple[Tensor, Tensor]:
    """Origins and paths (R, 3) of the rays from all surfels that face a light (L, 3) to it, those of a light together.

    They start off the receiver by as much as our kernel skips.
    """
    centers, normals = surfels.centers, surfels.normals
    skip = float(RECEIVER_SKIP) * surfels.scales.prod(dim=1).sqrt()
    origins, paths = [], []
    for light in lights:
        path = light - centers
        distance = path.norm(dim=1)
        facing = ((path * normals).sum(dim=1) > 0) & (distance > skip)
        share = (skip / distance)[:, None]
        origins.append((centers + share * path)[facing])
        paths.append(((1.0 - share) * path)[facing])
    return torch.cat(origins), torch.cat(paths)


def _row(rays: str, caster: str, count: int, ms: float, over_embree: float, note: str) -> dict:
    rate = {"mrays_per_s": 1e-3 * count / ms, "over_embree": over_embree}
    return {"rays": rays, "caster": caster, "count": count, "ms": ms} | rate | {"note": note}


def memory_traffic(operators: dict[str, SparseOperator], channels: int, repetitions: int) -> pd.DataFrame:
    """Memory traffic of sparse products, by name of the operator, beside that of a copy.

    A product must read its entries and write its result, and read its operand at least once: that many bytes in
    `ms` are its `gib_per_s`, and at the copy's rate they would take `floor_ms`. Operators that fit into a cache
    can be faster than that.
    """
    source = torch.ones(COPIED)
    target = torch.empty_like(source)
    copied = 2 * source.numel() * source.element_size()
    copy_ms = median_ms(lambda: target.copy_(source), repetitions)
    rows = [{"what": "copy", "entries": source.numel(), "bytes": copied, "ms": copy_ms}]
    for name, operator in operators.items():
        operand = torch.ones(operator.shape[1], channels, device=operator.matrix.device)
        size = ENTRY_BYTES * operator.entries + 4 * channels * sum(operator.shape)
        ms = median_ms(lambda: operator @ operand, repetitions)  # noqa: B023
        rows.append({"what": name, "entries": operator.entries, "bytes": size, "ms": ms})
    table = pd.DataFrame(rows)
    table["gib_per_s"] = table["bytes"] / 2**30 / (1e-3 * table["ms"])
    table["floor_ms"] = table["bytes"] / copied * copy_ms
    return table
