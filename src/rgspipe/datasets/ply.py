"""Surfels from PLY files: our own, 3DGS, 2DGS and RadiosityGS; see docs/reference/ply.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from rgspipe.datasets.conversion import Conversion, loss
from rgspipe.datasets.ply_cameras import find_cameras, read_viewpoints
from rgspipe.datasets.ply_gaussians import Discs, read_gaussians
from rgspipe.datasets.ply_options import PlyOptions
from rgspipe.datasets.ply_own import is_own, read_own, save_ply
from rgspipe.datasets.ply_radiosity import is_radiosity, read_radiosity
from rgspipe.datasets.ply_table import read_vertices
from rgspipe.errors import InputError
from rgspipe.renderer.fronts import backs_towards_cameras
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.orientation import backs_towards, turned_over
from rgspipe.scene.spacing import bounding_center, inferred_coverage
from rgspipe.scene.surfels import NO_CLIP, Surfels, quaternion_to_axes

#: Peak memory of freezing a surfel with 256 gather rays: 1.1 GB for the 10 000 of a trained Cornell box, a third of it
#: for those of an empty cube, whose rays meet fewer.
FREEZING_BYTES = 110e3

__all__ = ["PlyOptions", "load_ply", "save_ply"]


def load_ply(path: str | Path, options: PlyOptions | None = None) -> tuple[Surfels, Conversion]:
    """The surfels in a PLY file, float32 on the CPU, and what could not be taken over.

    Raises:
        InputError: no PLY file, a property is missing or has impossible values, or nothing says which side of the
            surfels is their front.
    """
    path, options = Path(path), options or PlyOptions()
    table = read_vertices(path)
    if is_own(table):
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
    left = loss("left out: outside of the box, or too faint to be there", 1.0 * ~kept, 0.0, "each")
    surfels, fronts = _oriented(surfels, path, options, own=is_own(table))
    return surfels, Conversion.of(path, layout, len(surfels), [*losses, left], [*notes, *fronts])


def _check_count(path: Path, kept: np.ndarray, options: PlyOptions) -> None:
    count = int(kept.sum())
    if count < 2:
        raise InputError(
            path,
            expected="surfels that can be seen",
            found=f"{count} of {len(kept)} in the box and above an opacity of {options.minimum_alpha}",
            remedy="Correct scene.ply.crop, or lower scene.ply.minimum_alpha.",
        )
    if options.max_surfels is not None and count > options.max_surfels:
        raise InputError(
            path,
            expected=f"at most {options.max_surfels} surfels (scene.ply.max_surfels)",
            found=f"{count}, of {len(kept)} in the file; frozen with the default rays they take about "
            f"{count * FREEZING_BYTES / 2**30:.0f} GiB of memory",
            remedy="Keep a part of the scene with scene.ply.crop=[x,y,z,x,y,z], thin the file in the program that made "
            "it, or raise scene.ply.max_surfels where there is the memory; fewer freeze.gather_rays take less.",
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
            path, expected="surfels that lie on surfaces", found=str(error), remedy="Check the file and scene.ply."
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


def _oriented(surfels: Surfels, path: Path, options: PlyOptions, *, own: bool) -> tuple[Surfels, list[str]]:
    """The surfels with their fronts where the options say, and that in words."""
    fronts = options.fronts
    cameras = options.cameras or (None if own else find_cameras(path))
    if fronts == "auto":
        fronts = "cameras" if options.cameras is not None else "kept" if own else "cameras"
    if fronts == "kept":
        return surfels, [] if own else ["Fronts are kept as the rotations have them."]
    if fronts == "cameras":
        if cameras is None:
            raise InputError(
                f"{path}: fronts",
                expected="to know which side of each surfel is seen: other programs draw both, light falls on one",
                found=f"scene.ply.fronts={options.fronts} and no cameras.json beside the file or in its model's folder",
                remedy="Set scene.ply.fronts=outwards for an object in empty space, inwards for a room, kept to trust "
                "the rotations, or scene.ply.cameras=FILE (cameras.json or a transforms file).",
            )
        away, where = backs_towards_cameras(surfels, read_viewpoints(cameras)), f"the cameras in {cameras}"
    else:
        away = backs_towards(surfels, bounding_center(surfels.centers)[None])
        away, where = (away, "the middle") if fronts == "inwards" else (~away, "away from the middle")
    return turned_over(surfels, away), [f"Fronts look towards {where}: {int(away.sum())} surfels were turned over."]
