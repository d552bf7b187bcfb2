"""InteriorVerse: `NNN_im.exr` with `_albedo`, `_depth` and `_material` beside it, without poses.

Images are linear, of any exposure. Depth is in millimetres. What is metal reflects nothing diffusely, so that the
diffuse albedo is albedo · (1 − metallic). Folders `dataset_85` and `dataset_120` (or scenes_85, scenes_120) name the
horizontal field of view.
"""

from __future__ import annotations

import re
from pathlib import Path

from rgspipe.datasets.scans.frame import DepthImage, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.single import chosen, lens_by_field, level_pose

#: Of the cameras.
AXES = "opengl"

WANTED = "NNN_im.exr with NNN_depth.exr and NNN_albedo.exr"

#: Degrees, where no folder says so.
USUAL_FIELD = 85.0

MILLIMETRE = 1e-3

FIELD = re.compile(r"(?:dataset|scenes)_(\d+)")


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return bool(_images(root))


def read(root: Path, options: ScanOptions) -> Scan:
    """One photograph with its maps.

    Raises:
        InputError: there are several, and none is named.
    """
    image = chosen(_images(root), root, options)
    field = options.fov or _field(root)
    unit = MILLIMETRE if options.depth_unit is None else options.depth_unit
    depth, albedo, material = (_beside(image, kind) for kind in ("depth", "albedo", "material"))
    frame = ScanFrame(
        image,
        lens_by_field(image, field),
        level_pose(),
        None if depth is None else DepthImage(depth, unit),
        albedo,
        material,
    )
    notes = (f"a field of view of {field:g}° is taken for granted (ScanOptions.fov)",)
    return Scan("interiorverse", image, (), (frame,), options.camera_axes(AXES), notes)


def _images(root: Path) -> list[Path]:
    return [path for path in sorted(root.glob("*_im.exr")) if path.name.split("_")[0].isdecimal()]


def _beside(image: Path, kind: str) -> Path | None:
    path = image.with_name(image.name.replace("_im.", f"_{kind}."))
    return path if path.is_file() else None


def _field(root: Path) -> float:
    named = [found for part in root.parts if (found := FIELD.fullmatch(part)) and 1 <= int(found[1]) <= 179]
    return float(named[-1][1]) if named else USUAL_FIELD
