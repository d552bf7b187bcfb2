"""Surfels as numbers that gradients move: how they start, how they become surfels again, and their limits."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from rgspipe.scene.surfels import NO_CLIP, Surfels, turn_in_plane

#: Limits of the coverage thresholds, and how far apart they stay.
LOW_RANGE, HIGH_RANGE, THRESHOLD_GAP = (0.05, 0.7), (0.3, 0.99), 0.1

#: Largest change of a log-scale over a whole training, down and up, and the range of an opacity's logit.
SHRINK, GROW, LOGIT_RANGE = 1.5, 0.6, (-4.0, 5.0)

#: Range of albedo while it moves with the geometry.
ALBEDO_RANGE = (0.005, 0.98)


def start_parameters(surfels: Surfels) -> dict[str, Tensor]:
    """Parameters that `build_surfels` turns into `surfels` themselves.

    offset (N, 2) in the plane and height (N,) along the normal, scene units; tilt (N, 2) of the normal about u
    and v and angle (N,) about the normal [rad]; log_scales (N, 2), logit (N,) of the opacity, clip_offsets and
    clip_angles (N, 2), albedo (N, 3), thresholds (2,) of the coverage.
    """
    coverage, device = surfels.coverage, surfels.centers.device
    return {
        "offset": torch.zeros_like(surfels.scales),
        "height": torch.zeros_like(surfels.opacities),
        "tilt": torch.zeros_like(surfels.scales),
        "angle": torch.zeros_like(surfels.opacities),
        "log_scales": surfels.scales.log(),
        "logit": torch.logit(surfels.opacities.clamp(0.01, 0.99)),
        "clip_offsets": surfels.clip_offsets.clone(),
        "clip_angles": surfels.clip_angles.clone(),
        "albedo": surfels.albedo.clone(),
        "thresholds": torch.tensor([coverage.low, coverage.high], device=device),
    }


def build_surfels(base: Surfels, parameters: dict[str, Tensor]) -> Surfels:
    """Surfels from parameters, differentiable; thresholds go into the coverage as numbers."""
    local = torch.cat([parameters["offset"], parameters["height"][:, None]], dim=1)
    low, high = parameters["thresholds"].detach().tolist()
    return replace(
        base,
        centers=base.centers + torch.einsum("na,nac->nc", local, base.frames),
        rotations=turn_in_plane(tilted(base.rotations, parameters["tilt"]), parameters["angle"]),
        scales=parameters["log_scales"].exp(),
        opacities=torch.sigmoid(parameters["logit"]),
        clip_offsets=parameters["clip_offsets"],
        # Clips stay where they are when the ellipse turns inside them.
        clip_angles=parameters["clip_angles"] - parameters["angle"][:, None],
        albedo=parameters["albedo"],
        coverage=replace(base.coverage, low=low, high=high),
    )


def tilted(quaternions: Tensor, tilt: Tensor) -> Tensor:
    """Rotations (N, 4) turned by rotation vectors `tilt` (N, 2) [rad] in their own u and v axes.

    A turn about u by a positive angle leans the normal towards −v, one about v towards u.
    """
    w, x, y, z = quaternions.unbind(-1)
    half = 0.5 * tilt
    length = half.square().sum(dim=1)
    # sin(|h|)/|h| and cos|h| as series in |h|²: exact to 1e-7 below 0.5 rad, and smooth at zero.
    sinc = 1.0 - length / 6.0 + length.square() / 120.0
    c = 1.0 - length / 2.0 + length.square() / 24.0
    a, b = (sinc[:, None] * half).unbind(-1)
    turned = torch.stack([w * c - x * a - y * b, x * c + w * a - z * b, y * c + w * b + z * a, z * c + x * b - y * a])
    return torch.nn.functional.normalize(turned.T, dim=1)


def limit(parameters: dict[str, Tensor], base: Surfels, start_log_scales: Tensor) -> None:
    """Bring parameters back into their ranges, in place.

    Args:
        start_log_scales: (N, 2) of the surfels that training began with.
    """
    log_scales = torch.maximum(parameters["log_scales"], start_log_scales - SHRINK)
    parameters["log_scales"] = torch.minimum(log_scales, start_log_scales + GROW)
    parameters["logit"].clamp_(*LOGIT_RANGE)
    parameters["albedo"].clamp_(*ALBEDO_RANGE)
    unclipped = base.clip_offsets >= NO_CLIP
    parameters["clip_offsets"] = torch.where(unclipped, base.clip_offsets, parameters["clip_offsets"])
    low = parameters["thresholds"][0].clamp(*LOW_RANGE)
    high = torch.maximum(parameters["thresholds"][1].clamp(*HIGH_RANGE), low + THRESHOLD_GAP)
    parameters["thresholds"] = torch.stack([low, high])
