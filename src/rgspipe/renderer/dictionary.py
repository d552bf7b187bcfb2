"""Candidate positions of a light, with what a light there would send to every surfel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import scipy.spatial
import torch
from torch import Tensor

from rgspipe.arguments import as_count
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.reach import LEAST_FLUX, Reach
from rgspipe.renderer.surroundings import Surroundings
from rgspipe.scene.surfels import Surfels

#: Candidates along each axis.
GRID = 8

#: A candidate moves from its grid point by up to this share of the grid's step, so that no wall of a box-shaped
#: scene is met by a whole layer of candidates in the same way.
JITTER = 0.15

#: The outermost candidates stand this share of a grid step inside the bounding box.
INSET = 0.4

#: A light nearer to a surfel than this many of its scales is inside the surface as the scene knows it.
CLEARANCE_SCALES = 2.0

#: Candidates whose shadows are computed at once; bounds the memory of the derivative that comes with them.
BATCH = 8


@dataclass(frozen=True)
class LightDictionary:
    """Unit lights all over a scene.

    Attributes:
        positions: (C, 3) float64, on the CPU: a scene may be far from the origin.
        irradiance: (C, N) float32 on every surfel, per W/sr.
        grid, seed: what they were made with.
    """

    positions: Tensor
    irradiance: Tensor
    grid: int = GRID
    seed: int = 0

    def __len__(self) -> int:
        return len(self.positions)

    def to(self, device: torch.device | str) -> LightDictionary:
        """The same with the irradiance on another device."""
        return replace(self, irradiance=self.irradiance.to(device))

    def reach(self, areas: Tensor, surroundings: Surroundings) -> Reach:
        """How much of a light in the best places reaches the scene, of N surfels of `areas` (N,)."""
        return Reach.of(surroundings, self.positions, self.irradiance @ areas.to(self.irradiance))

    def joined(self, bvh: SurfelBvh, positions: Tensor, shadows: bool = True) -> LightDictionary:
        """The same with further unit lights at `positions` (K, 3), among N surfels."""
        more = _irradiance(bvh, positions, shadows)
        irradiance = torch.cat([self.irradiance, more.to(self.irradiance)])
        return replace(self, positions=torch.cat([self.positions, positions.to(self.positions)]), irradiance=irradiance)


def candidate_grid(lower: Tensor, upper: Tensor, grid: int, seed: int) -> Tensor:
    """(grid³, 3) jittered points in the box from `lower` to `upper` (3,), float64."""
    generator = torch.Generator().manual_seed(seed)
    step = (torch.arange(grid, dtype=torch.float64) + 0.5) / grid
    step = 0.5 + (step - 0.5) * (grid - 2 * INSET) / max(1, grid - 1)
    unit = torch.stack(torch.meshgrid(step, step, step, indexing="ij"), dim=-1).reshape(-1, 3)
    unit = unit + (2.0 * torch.rand(unit.shape, generator=generator, dtype=torch.float64) - 1.0) * JITTER / grid
    return lower + unit * (upper - lower)


def build_dictionary(
    bvh: SurfelBvh,
    areas: Tensor,
    surroundings: Surroundings,
    grid: int = GRID,
    *,
    seed: int = 0,
    shadows: bool = True,
    at: Tensor | None = None,
) -> LightDictionary:
    """Candidates on a grid of the scene's bounding box, without those inside or too near to its surfaces.

    An open scene has candidates around it as well. All light it; see `reach`.

    Args:
        bvh: the surfels.
        areas: (N,) surface of each, or of what each of those that are looked at stands for, scene units².
        grid: candidates along each axis.
        seed: of the jitter.
        shadows: whether surfels block light.
        at: (N,) int64 surfels that are looked at; all if None.

    Raises:
        InputError: an impossible grid or seed; or the scene is so small in its unit of length that the images of unit
            lights cannot be compared, or so far from the origin that its places cannot.
    """
    as_count(grid, "grid"), as_count(seed, "seed", 0)
    _check_place(surroundings)
    positions = candidate_grid(surroundings.lower, surroundings.upper, grid, seed)
    positions = positions[_clear_of_surfels(bvh.surfels, positions)]
    if surroundings.open:
        positions = torch.cat([positions, surroundings.shell_points()])
    irradiance = _irradiance(bvh, positions, shadows, at, shown=True)
    _check_unit(irradiance, surroundings)
    flux = irradiance @ areas.to(irradiance)
    kept = Reach.of(surroundings, positions, flux).shares(positions, flux) > LEAST_FLUX
    return LightDictionary(positions[kept], irradiance[kept.to(irradiance.device)], grid, seed)


def _check_place(surroundings: Surroundings) -> None:
    """Refuse a scene so far from the origin that float32, in which some of a search's places are, has it in one."""
    lower, upper = surroundings.lower, surroundings.upper
    farthest = float(torch.maximum(lower.abs(), upper.abs()).amax())
    if torch.finfo(torch.float32).eps * farthest > 0.5 * surroundings.size:
        raise InputError(
            "the scene",
            expected="coordinates of which float32 tells one end of the scene from the other",
            found=f"a scene {surroundings.size:.2g} units large that is {farthest:.2g} from the origin",
            remedy="Take one offset away from the places of all cameras, surfels and lights.",
        )


def _check_unit(irradiance: Tensor, surroundings: Surroundings) -> None:
    """Refuse a scene in which unit lights are so bright that float32 does not hold the squares of their images."""
    if irradiance.numel() and not bool(irradiance.amax().square().isfinite()):
        raise InputError(
            "the scene",
            expected="a size in which 1 W/sr lights it by less than 1.8e19 W/m², whose square float32 can hold",
            found=f"one {surroundings.size:.2g} units large, lit by up to {float(irradiance.amax()):.2g}",
            remedy="Give the lengths of cameras, depth and surfels in a smaller unit, so that they are larger numbers.",
        )


def _irradiance(
    bvh: SurfelBvh, positions: Tensor, shadows: bool, at: Tensor | None = None, *, shown: bool = False
) -> Tensor:
    """(C, N) of unit lights at `positions` (C, 3) on every surfel, or those `at` (N,)."""
    batches = range(0, len(positions), BATCH)
    batches = progress_bar(batches, "light dictionary", unit="batch") if shown else batches
    rows = [unit_irradiance(bvh, positions[start : start + BATCH], shadows, at)[0] for start in batches]
    return torch.cat(rows) if rows else torch.zeros((0, len(bvh.surfels)), device=bvh.device)


def _clear_of_surfels(surfels: Surfels, positions: Tensor) -> Tensor:
    """(C,) bool: the nearest surfel is farther than CLEARANCE_SCALES of its scales."""
    tree = scipy.spatial.cKDTree(surfels.centers.double().cpu().numpy())
    distance, nearest = tree.query(positions.double().numpy())
    scales = surfels.scales.double().cpu().prod(dim=1).sqrt()[torch.from_numpy(nearest)]
    return torch.from_numpy(distance) > CLEARANCE_SCALES * scales
