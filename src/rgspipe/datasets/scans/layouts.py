"""Which layout a folder has, and reading it."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

from rgspipe.datasets.input_file import input_folder
from rgspipe.datasets.scans import (
    arkitscenes,
    colmap,
    iid,
    interiorverse,
    nerfstudio,
    openrooms,
    polycam,
    replica,
    scannet,
    seven_scenes,
    tum,
)
from rgspipe.datasets.scans.frame import Scan
from rgspipe.datasets.scans.lens_check import check_lens
from rgspipe.datasets.scans.missing_files import refuse_missing, without_missing
from rgspipe.datasets.scans.options import LAYOUTS, ScanOptions
from rgspipe.errors import InputError

MODULES = (
    nerfstudio,
    polycam,
    colmap,
    replica,
    scannet,
    iid,
    interiorverse,
    openrooms,
    tum,
    seven_scenes,
    arkitscenes,
)
READERS: dict[str, ModuleType] = dict(zip(LAYOUTS, MODULES, strict=True))

#: Names of a folder that errors list.
SHOWN = 12


def read_scan(root: str | Path, options: ScanOptions, *, depth: bool = True) -> Scan:
    """The cameras of a capture, thinned to the frames that are wanted; no pixel has been read.

    Args:
        depth: whether some of the photographs must have depth.

    Raises:
        InputError: no layout or several fit, files of the layout or photographs are missing or broken, or there is no
            depth.
    """
    root = input_folder(root, "the folder of a capture")
    scan = READERS[_layout(root, options)].read(root, options)
    scan = (scan if options.missing == "refuse" else without_missing(scan)).thinned(options.frames)
    refuse_missing(scan)
    if depth and all(frame.depth is None for frame in scan.frames):
        raise InputError(
            root,
            expected="depth of the photographs, where the layout has it (docs/reference/capture_layouts.md)",
            found="none: poses, and the points of a sparse model, are no surfaces",
            remedy="Of COLMAP, run image_undistorter and patch_match_stereo and give its workspace; else "
            "add depth of a sensor in the unit of the poses, or give a mesh of the room: read_mesh(FILE).",
        )
    for frame in scan.frames:
        check_lens(frame.lens, f"{scan.stated}: intrinsics of {frame.image.name}")
        if frame.depth is not None and frame.depth.lens is not None:
            check_lens(frame.depth.lens, f"{scan.stated}: intrinsics of {frame.depth.path.name}")
    return scan


def _layout(root: Path, options: ScanOptions) -> str:
    fitting = [name for name, reader in READERS.items() if reader.found_in(root)]
    if options.format != "auto":
        if options.format not in fitting:
            wanted = READERS[options.format].WANTED
            others = f" (it looks like {' and '.join(fitting)})" if fitting else ""
            raise InputError(
                root,
                expected=f"{wanted}, of a capture in the layout {options.format}",
                found=f"{_listed(root)}{others}",
                remedy="Correct the path or ScanOptions.format.",
            )
        return options.format
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        remedy = f"Say which: ScanOptions(format={fitting[0]!r})."
        found = f"files of {' and '.join(fitting)}"
        raise InputError(root, expected="a capture in one layout", found=found, remedy=remedy)
    wanted = "; ".join(f"{name}: {reader.WANTED}" for name, reader in READERS.items())
    raise InputError(
        root,
        expected=f"a capture in one of these layouts: {wanted}",
        found=_listed(root),
        remedy="Correct the path: it is the folder that holds these. A dataset in our own layout is for "
        "rg.load_views(folder). Photographs alone need poses and depth first, such as COLMAP's: see "
        "docs/guides/photographs.md.",
    )


def _listed(root: Path) -> str:
    names = sorted(f"{path.name}/" if path.is_dir() else path.name for path in root.iterdir())
    return ", ".join(names[:SHOWN]) + (", …" if len(names) > SHOWN else "") if names else "an empty folder"
