"""Surfels in PLY files: our own, 3DGS, 2DGS and RadiosityGS; see docs/reference/ply.md."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from rgspipe.datasets.conversion import Conversion, loss
from rgspipe.datasets.ply.gaussians import Discs, read_gaussians
from rgspipe.datasets.ply.options import PlyOptions
from rgspipe.datasets.ply.own import is_own, read_own, save_ply
from rgspipe.datasets.ply.radiosity import is_radiosity, read_radiosity
from rgspipe.datasets.ply.table import read_vertices
from rgspipe.datasets.surfel_range import check_surfels
from rgspipe.errors import InputError
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.spacing import inferred_coverage
from rgspipe.scene.surfels import NO_CLIP, Surfels, quaternion_to_axes

#: Peak memory of freezing a surfel with 256 gather rays: 1.1 GB for the 10 000 of a trained Cornell box, a third of it
#: for those of an empty cube, whose rays meet fewer.
FREEZING_BYTES = 110e3

#: How less of a file is taken.
CROP = "PlyOptions(crop=[x, y, z, x, y, z])"

__all__ = ["PlyOptions", "PlySurfels", "read_ply", "save_ply"]


@dataclass(frozen=True)
class PlySurfels:
    """What is in a PLY file.

    Attributes:
        surfels: float32, on the CPU, with their fronts as the rotations have them.
        own: whether the file is of this program, and says which side is the front.
        conversion: what could not be taken over.
    """

    surfels: Surfels
    own: bool
    conversion: Conversion


def read_ply(path: Path, options: PlyOptions) -> PlySurfels:
    """The surfels in a PLY file, with their fronts where the file has them.

    Raises:
        InputError: no PLY file, or a property is missing or has impossible values.
    """
    table = read_vertices(path)
    own = is_own(table)
    if own:
        surfels, conversion = read_own(table, options)
        kept, losses, notes = np.ones(len(surfels), bool), conversion.losses, list(conversion.notes)
        if options.crop is not None:
            kept = _kept(surfels.centers.numpy(), np.ones(len(surfels)), options)
        _check_count(path, kept, options)
        layout, surfels = conversion.layout, _chosen(surfels, torch.from_numpy(kept))
    else:
        discs = (read_radiosity if is_radiosity(table) else read_gaussians)(table, options)
        kept = _kept(discs.centers, discs.opacities, options)
        _check_count(path, kept, options)
        layout, losses, surfels = discs.layout, discs.losses, _dressed(path, discs, kept, options)
        rule = surfels.coverage
        notes = [*discs.notes, f"Coverage is inferred: thresholds {rule.low:g} and {rule.high:g}, layers of "
                 f"{rule.layer_thickness:.3g}."]  # fmt: skip
    check_surfels(path, surfels, f"Correct them, leave them out with {CROP}, or export it again.")
    left = loss("left out: outside of the box, or too faint to be there", 1.0 * ~kept, 0.0, "each")
    return PlySurfels(surfels, own, Conversion.of(path, layout, len(surfels), [*losses, left], notes))


def _check_count(path: Path, kept: np.ndarray, options: PlyOptions) -> None:
    count = int(kept.sum())
    if count < 2:
        raise InputError(
            path,
            expected="surfels that can be seen",
            found=f"{count} of {len(kept)} in the box and above an opacity of {options.minimum_alpha}",
            remedy="Correct PlyOptions.crop, or lower PlyOptions.minimum_alpha.",
        )
    if count > options.max_surfels:
        raise InputError(
            path,
            expected=f"at most {options.max_surfels} surfels (PlyOptions.max_surfels)",
            found=f"{count}, of {len(kept)} in the file; frozen with the default rays they take about "
            f"{count * FREEZING_BYTES / 2**30:.0f} GiB of memory",
            remedy=f"Keep a part of the scene with {CROP}, thin the file in the program that made it, or raise "
            "PlyOptions.max_surfels where there is the memory; fewer rays take less "
            "(FrozenScene.freeze(gather_rays=…)).",
        )


def _dressed(path: Path, discs: Discs, kept: np.ndarray, options: PlyOptions) -> Surfels:
    """The kept discs as surfels, with a coverage that suits them."""
    tensors = {
        name: torch.from_numpy(getattr(discs, name)[kept]).float()
        for name in ("centers", "rotations", "scales", "opacities", "albedo")
    }
    gloss = None
    if discs.reflectance is not None and discs.exponents is not None:
        gloss = Gloss(*(torch.from_numpy(x[kept]).float() for x in (discs.reflectance, discs.exponents)))
    try:
        coverage = inferred_coverage(
            tensors["centers"],
            quaternion_to_axes(tensors["rotations"])[:, 2],
            tensors["scales"],
            low=discs.low,
            high=discs.high,
            layer=options.layer,
            minimum_alpha=options.minimum_alpha,
        )
    except ValueError as error:
        raise InputError(
            path, expected="surfels that lie on surfaces", found=str(error), remedy="Check the file and PlyOptions."
        ) from error
    edges = {
        "clip_offsets": torch.full_like(tensors["scales"], NO_CLIP),
        "clip_angles": torch.zeros_like(tensors["scales"]),
    }
    return Surfels(**tensors, **edges, coverage=coverage, gloss=gloss)


def _kept(centers: np.ndarray, opacities: np.ndarray, options: PlyOptions) -> np.ndarray:
    """(N,) bool, those in the box that is kept, and not too faint to be there."""
    kept = opacities > options.minimum_alpha
    if options.crop is not None:
        lower, upper = np.array(options.crop[:3]), np.array(options.crop[3:])
        kept &= ((centers >= lower) & (centers <= upper)).all(axis=1)
    return kept


def _chosen(surfels: Surfels, kept: Tensor) -> Surfels:
    gloss = None if surfels.gloss is None else Gloss(*(x[kept] for x in surfels.gloss.tensors().values()))
    parts = {name: tensor[kept] for name, tensor in surfels.tensors().items()}
    return Surfels(**parts, coverage=surfels.coverage, gloss=gloss)
