"""Surfels from PLY files, with their fronts on the side that light falls on, which files from elsewhere do not tell."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rgspipe.arguments import as_path
from rgspipe.datasets.conversion import Conversion
from rgspipe.datasets.ply.cameras import find_cameras, read_viewpoints
from rgspipe.datasets.ply.file import PlyOptions, read_ply
from rgspipe.errors import InputError
from rgspipe.renderer.fronts import backs_towards_cameras
from rgspipe.scene.orientation import backs_towards, turned_over
from rgspipe.scene.spacing import bounding_center
from rgspipe.scene.surfels import Surfels


def load_ply(path: str | Path, options: PlyOptions | None = None) -> tuple[Surfels, Conversion]:
    """The surfels in a PLY file, float32 on the CPU, and what could not be taken over.

    Raises:
        InputError: no PLY file, a property is missing or has impossible values, or nothing says which side of the
            surfels is their front.
    """
    path, options = as_path(path), options or PlyOptions()
    read = read_ply(path, options)
    surfels, fronts = _oriented(read.surfels, path, options, own=read.own)
    return surfels, replace(read.conversion, notes=(*read.conversion.notes, *fronts))


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
                found=f"PlyOptions(fronts={options.fronts!r}) and no cameras.json beside the file or in its model's "
                "folder",
                remedy="Set PlyOptions(fronts='outwards') for an object in empty space, inwards for a room, kept to "
                "trust the rotations, or PlyOptions(cameras=FILE) (cameras.json or a transforms file).",
            )
        away, where = backs_towards_cameras(surfels, read_viewpoints(cameras)), f"the cameras in {cameras}"
    else:
        away = backs_towards(surfels, bounding_center(surfels.centers)[None])
        away, where = (away, "the middle") if fronts == "inwards" else (~away, "away from the middle")
    return turned_over(surfels, away), [f"Fronts look towards {where}: {int(away.sum())} surfels were turned over."]
