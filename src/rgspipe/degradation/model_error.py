"""A scene model that is wrong by a stated amount: albedo, geometry, an object that is missing.

Every draw comes from the seed; one kind of error has the same draws whatever the others are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from rgspipe.degradation.options import ModelError
from rgspipe.errors import InputError
from rgspipe.scene.surfels import Surfels

#: Waves that a random field is made of.
WAVES = 64

#: Correlation length of the error of albedo, in parts of the scene's size.
ALBEDO_LENGTH = 0.15

#: No surface reflects more than this, diffusely and in its lobe together.
LARGEST_REFLECTANCE = 0.99


def with_error(surfels: Surfels, error: ModelError) -> Surfels:
    """The surfels (N) of a model with these errors; fewer where some are missing.

    Raises:
        InputError: the box of what is missing holds no surfel, or all of them.
    """
    if error.none:
        return surfels
    albedo_rng, position_rng, tilt_rng = (torch.Generator().manual_seed(3 * error.seed + kind) for kind in range(3))
    centers = surfels.centers.double()
    size = float((centers.amax(dim=0) - centers.amin(dim=0)).amax())
    changed = replace(surfels, albedo=_wrong_albedo(surfels, error, size, albedo_rng))
    if error.position > 0.0:
        shift = error.position * size * torch.randn(len(centers), 1, generator=position_rng, dtype=torch.float64)
        changed = replace(changed, centers=(centers + shift.to(centers) * surfels.normals.double()).to(surfels.centers))
    if error.tilt > 0.0:
        turn = math.radians(error.tilt) * torch.randn(len(centers), 2, generator=tilt_rng, dtype=torch.float64)
        changed = replace(changed, rotations=_tilted(surfels.rotations, turn))
    return changed if error.missing is None else _without(changed, error.missing)


def smooth_field(points: Tensor, length: float, count: int, generator: torch.Generator) -> Tensor:
    """(N, count) float64 Gaussian random fields at points (N, 3): mean 0, variance 1, correlation exp(−d²/2 length²).

    Random waves: √(2/WAVES) Σ cos(k·x + φ) with k normal of deviation 1/length (Rahimi and Recht 2007).
    """
    waves = torch.randn(count, WAVES, 3, generator=generator, dtype=torch.float64) / length
    phases = 2.0 * math.pi * torch.rand(count, WAVES, generator=generator, dtype=torch.float64)
    angles = torch.einsum("nx,cwx->ncw", points.double().cpu(), waves) + phases
    return math.sqrt(2.0 / WAVES) * angles.cos().sum(dim=2)


def _wrong_albedo(surfels: Surfels, error: ModelError, size: float, generator: torch.Generator) -> Tensor:
    """(N, 3) albedo with its error, within what can be reflected."""
    factor = torch.full((len(surfels), 3), error.albedo_factor, dtype=torch.float64)
    if error.albedo > 0.0 and size > 0.0:
        factor = factor * (error.albedo * smooth_field(surfels.centers, ALBEDO_LENGTH * size, 3, generator)).exp()
    largest = torch.full_like(factor, LARGEST_REFLECTANCE)
    if surfels.gloss is not None:
        largest = (largest - surfels.gloss.reflectance.double().cpu()).clamp(min=0.0)
    albedo = surfels.albedo.double().cpu()
    # What reflects more than that already stays as it is.
    return torch.minimum(albedo * factor, torch.maximum(largest, albedo)).to(surfels.albedo)


def _tilted(rotations: Tensor, turn: Tensor) -> Tensor:
    """(N, 4) quaternions after a turn (N, 2) [rad] about each surfel's own u and v axes."""
    own = Rotation.from_quat(rotations.double().cpu().numpy(), scalar_first=True)
    about = Rotation.from_rotvec(torch.nn.functional.pad(turn, (0, 1)).numpy())
    return torch.from_numpy((own * about).as_quat(scalar_first=True)).to(rotations)


def _without(surfels: Surfels, box: Sequence[float]) -> Surfels:
    """The surfels outside a box."""
    corners = torch.tensor(list(box), dtype=torch.float64).reshape(2, 3)
    centers = surfels.centers.double().cpu()
    inside = ((centers >= corners[0]) & (centers <= corners[1])).all(dim=1)
    if not bool(inside.any()) or bool(inside.all()):
        lower, upper = (corner.tolist() for corner in (centers.amin(dim=0), centers.amax(dim=0)))
        raise InputError(
            "ModelError.missing",
            expected=f"a box that holds some of the surfels, which are between {lower} and {upper}, but not all",
            found=f"{list(box)} with {int(inside.sum())} of {len(surfels)}",
            remedy="Give the lower and then the upper corner of what is to be left out, scene units.",
        )
    return surfels.selected((~inside).to(surfels.centers.device))
