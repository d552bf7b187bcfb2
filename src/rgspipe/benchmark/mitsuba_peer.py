"""Mitsuba 3's path tracer beside ours: the same room, cameras, lights and truth."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from rgspipe.benchmark.mitsuba_process import PeerMissing, ask_mitsuba, mitsuba_version
from rgspipe.benchmark.rooms import Room
from rgspipe.benchmark.truth import MAX_BOUNCES, Truth

#: Samples per pixel of images, and of steps with a gradient.
SAMPLES, GRADIENT_SAMPLES = (4, 16, 64, 256, 1024), (16, 64)

#: How far the target of a timed step is from the image; a step costs the same for any.
TARGET_SCALE = 0.9


def mitsuba_rows(
    room: Room,
    truth: Truth,
    repetitions: int,
    *,
    away: Sequence[Tensor] | None = None,
    samples: Sequence[int] = SAMPLES,
    gradient_samples: Sequence[int] = GRADIENT_SAMPLES,
) -> pd.DataFrame:
    """One row per number of samples: error of Mitsuba's `path` against the truth, and its time; warm, all cores.

    Derivatives are plain automatic ones of `path`: they leave out what moving shadow edges contribute, but the
    integrators that replay paths refuse a point light's position.

    Args:
        room: what is rendered, all cameras and lights.
        truth: of the same room; its resolution is used.
        repetitions: of each timing, at most; long ones are repeated less often.
        away: for each camera (H, W) boolean, True away from edges.
        samples: per pixel.
        gradient_samples: of these, for which a step (image and gradient towards the position) is timed.

    Returns:
        `renderer`, `room`, `spp`, `note`; `global_db`, `global_db_off_edges`, `global_relative`, means over cameras
        and lights, and `global_db_worst`; `forward_ms` of an image, `step_ms` of image and gradient, `first_ms`
        from the room to the first image with kernels compiled or taken from the cache. Where Mitsuba cannot run,
        the figures are missing and `note` says why.
    """
    arrays = {
        "corners": room.surfaces.corners.numpy(),
        "albedo": room.surfaces.albedo.numpy(),
        "poses": np.stack([camera.camera_to_world.numpy() for camera in room.cameras(truth.resolution)]),
        "lights": room.lights.double().numpy(),
        "target": TARGET_SCALE * truth.image(0, 0, "global").numpy(),
    }
    try:
        renderer = f"Mitsuba {mitsuba_version()} path"
        figures, images = ask_mitsuba(
            "render", arrays, field_of_view=room.field_of_view, resolution=truth.resolution,
            max_depth=MAX_BOUNCES + 2, samples=list(samples), gradient_samples=list(gradient_samples),
            repetitions=repetitions,
        )  # fmt: skip
    except PeerMissing as missing:
        return pd.DataFrame([_row("Mitsuba path", room, spp) | {"note": str(missing)} for spp in samples])
    rows = []
    for spp in samples:
        row = _row(renderer, room, spp) | _errors(truth, torch.from_numpy(images[f"images_{spp}"]), away)
        row |= {name: figures[name].get(str(spp), np.nan) for name in ("forward_ms", "step_ms", "first_ms")}
        rows.append(row | {"note": f"{figures['variant']}, {figures['threads']} threads"})
    return pd.DataFrame(rows)


def _row(renderer: str, room: Room, spp: int) -> dict:
    names = ("global_db", "global_db_off_edges", "global_db_worst", "global_relative")
    figures = dict.fromkeys((*names, "forward_ms", "step_ms", "first_ms"), np.nan)
    return {"renderer": renderer, "room": room.name, "spp": spp} | figures


def _errors(truth: Truth, images: Tensor, away: Sequence[Tensor] | None) -> dict[str, float]:
    """Of images (K, L, H, W, 3)."""
    places = [(camera, light) for camera in range(images.shape[0]) for light in range(images.shape[1])]
    decibels = [truth.psnr(images[place], *place, "global") for place in places]
    relative = [truth.relative_error(images[place], *place, "global") for place in places]
    errors = {"global_db": fmean(decibels), "global_db_worst": min(decibels), "global_relative": fmean(relative)}
    if away is not None:
        masked = [truth.psnr(images[place], *place, "global", away[place[0]]) for place in places]
        errors["global_db_off_edges"] = fmean(masked)
    return errors
