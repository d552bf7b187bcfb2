"""A capture of another program written as a dataset in our own layout, at the size that is worked with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rgspipe.datasets.exif_exposure import differ, exposure_of
from rgspipe.datasets.exr import write_channels, write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.info import INFO
from rgspipe.datasets.scans.frame import Lens, Scan, ScanFrame
from rgspipe.datasets.scans.lens_check import check_shape
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import Picture, read_depth_image, read_picture
from rgspipe.datasets.scans.resample import resampled_colour, resampled_depth, straight_camera
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar
from rgspipe.scene import Camera
from rgspipe.scene.passes import Passes
from rgspipe.store.files import write_json

TRANSFORMS = "transforms_train.json"

#: What a camera sees of surfaces that are known.
Surfaces = Callable[[Camera], Passes]

VERSION = 1


@dataclass(frozen=True)
class Imported:
    """What was written.

    Attributes:
        frames: photographs.
        with_depth: those of them that have depth somewhere.
        known: part of their pixels whose depth is known.
        exif: whether photographs were made alike by the exposures that they state.
        notes: what was assumed.
    """

    frames: int
    with_depth: int
    known: float
    exif: bool
    notes: tuple[str, ...]

    def words(self, layout: str) -> str:
        """The report for people."""
        exposures = ", made alike by their EXIF exposures" if self.exif else ""
        photographs = f"{self.frames} photograph{'s' * (self.frames != 1)}{exposures}"
        lines = [
            f"{layout}: {photographs}; {self.with_depth} with depth, known in {100 * self.known:.0f} % of their pixels"
        ]
        return "\n".join(lines + [f"  {note}" for note in self.notes])


def import_scan(scan: Scan, options: ScanOptions, folder: Path, surfaces: Surfaces | None = None) -> Imported:
    """Write the photographs of a capture as training views under lamps that are not known.

    Args:
        surfaces: of the room, if they are known, in the place of measured depth.

    Raises:
        InputError: a file is missing, broken, or of another kind than its layout says.
    """
    exposures = _exposures(scan, options)
    factors = np.ones(len(scan.frames)) if exposures is None else exposures
    entries, known = [], []
    pairs = list(zip(scan.frames, factors, strict=True))
    for index, (frame, factor) in enumerate(progress_bar(pairs, "reading photographs", unit="photograph")):
        entry, share = _written(frame, float(factor), options, folder / f"train/r_{index:04d}", surfaces)
        lighting = {"lighting": frame.lighting} if frame.lighting else {}
        entries.append(entry | {"source": frame.image.name} | lighting)
        known.append(share)
    write_transforms(folder / TRANSFORMS, entries)
    write_json(folder / INFO, {"version": VERSION, "depth_convention": "planar_z", "layout": scan.layout})
    shares = [share for share in known if share]
    share = float(np.mean(shares)) if shares else 0.0
    return Imported(len(entries), len(shares), share, exposures is not None, scan.notes)


def _exposures(scan: Scan, options: ScanOptions) -> np.ndarray | None:
    """(V,) exposures by EXIF over their geometric mean; None where one does not say, and the others are alike.

    Raises:
        InputError: one does not say, and the others differ.
    """
    if options.exposure != "exif":
        return None
    stated = [exposure_of(frame.image) for frame in scan.frames]
    known = np.array([value for value in stated if value is not None])
    if len(known) < len(stated):
        if differ(known.tolist()):
            raise InputError(
                scan.frames[stated.index(None)].image,
                expected="shutter, aperture and ISO (EXIF), as in other photographs, whose exposures differ by a "
                f"factor of {known.max() / known.min():.3g}",
                found=f"not all three in {len(stated) - len(known)} of {len(stated)} photographs",
                remedy="Leave those out, or take all as they are: ScanOptions(exposure='same').",
            )
        return None
    return known / np.exp(np.log(known).mean())


def _written(
    frame: ScanFrame, exposure: float, options: ScanOptions, path: Path, surfaces: Surfaces | None
) -> tuple[dict, float | None]:
    """The entry of a frame whose files were written to `path`, and the part of its depth that is known, if any is."""
    stated = (frame.lens.width, frame.lens.height) if frame.size_stated else None
    picture = read_picture(frame.image, options.response, stated)
    check_shape(frame.image, picture.light.shape, frame.lens)
    height, width = picture.light.shape[:2]
    # Intrinsics may be of a larger image: no camera has more pixels than the photograph.
    camera = straight_camera(frame.lens.resized(width, height), frame.pose, options.resolution, frame.image)
    light, clipped = resampled_colour(picture.light, picture.clipped_from, camera, frame.lens)
    entry: dict = {}
    if picture.clipped_from is not None:
        limit = np.float32(picture.clipped_from)
        light = np.where(clipped, np.maximum(light, limit), light)
        entry["saturated_from"] = float(limit / np.float32(exposure))
    write_image(path.with_suffix(".exr"), light / np.float32(exposure))
    passes = _measured(frame, camera) if surfaces is None else surfaces(camera)
    used = _used(frame, picture, camera)
    if used is not None:
        passes = replace(passes, depth=None if passes.depth is None else np.where(used, passes.depth, np.nan))
        write_channels(path.with_name(f"{path.name}_mask.exr"), {"A": used.astype(np.float32)})
        entry["mask_path"] = f"./{path.parent.name}/{path.name}_mask.exr"
    share = None if passes.depth is None else float(np.isfinite(passes.depth).mean())
    kinds = _write_passes(passes if share else replace(passes, depth=None), path)
    return frame_entry(f"{path.parent.name}/{path.name}", camera, surfaces=kinds) | entry, share


def _measured(frame: ScanFrame, camera: Camera) -> Passes:
    """Depth and predicted albedo of a frame, as far as it has them; networks write albedo in sRGB or floats."""
    depth = albedo = None
    if frame.depth is not None:
        stored, lens = read_depth_image(frame.depth), frame.depth.lens or frame.lens
        check_shape(frame.depth.path, stored.shape, lens)
        depth = resampled_depth(stored, camera, lens)
    if frame.albedo is not None:
        albedo, _ = resampled_colour(read_picture(frame.albedo, "srgb").light, None, camera, frame.lens)
    if albedo is not None and frame.material is not None:
        material, _ = resampled_colour(read_picture(frame.material, "linear").light, None, camera, frame.lens)
        albedo = albedo * (1.0 - np.clip(material[..., 1:2], 0.0, 1.0))
    return Passes(depth, None, albedo)


def _used(frame: ScanFrame, picture: Picture, camera: Camera) -> np.ndarray | None:
    """(H, W) bool: which of a camera's pixels show nothing that is masked or not opaque; None where all count.

    Raises:
        InputError: nothing of the photograph is opaque, as programs write that have no use for alpha.
    """
    if picture.hidden is not None and picture.hidden.all():
        expected, remedy = "a photograph with pixels that are opaque", "Write it without alpha, or correct its alpha."
        raise InputError(frame.image, expected=expected, found="none", remedy=remedy)
    hidden = [picture.hidden]
    if frame.mask is not None:
        mask = read_picture(frame.mask, "linear")
        check_shape(frame.mask, mask.light.shape, frame.lens)
        if not mask.light.any():
            found, remedy = "black everywhere", "Invert it if black is what counts, or leave the photograph out."
            expected = "a mask that is black where the photograph is not to be used, and white elsewhere"
            raise InputError(frame.mask, expected=expected, found=found, remedy=remedy)
        # Masks may be of levels 0 and 1: whatever is not black counts.
        hidden += [mask.hidden, (mask.light <= 0.0).any(axis=2)]
    if frame.border:
        rim = np.ones(picture.light.shape[:2], bool)
        wide = int(np.ceil(frame.border * max(rim.shape)))
        rim[wide:-wide, wide:-wide] = False
        hidden.append(rim)
    parts = [part for part in hidden if part is not None]
    return ~np.any([_shown(part, camera, frame.lens) for part in parts], axis=0) if parts else None


def _shown(where: np.ndarray, camera: Camera, lens: Lens) -> np.ndarray:
    """(H, W) bool: which of a camera's pixels show any of those that are marked (H, W bool) in an image."""
    # What is marked is "clipped": any sample of it counts.
    marked = np.repeat(where[..., None].astype(np.float32), 3, axis=2)
    return resampled_colour(marked, 1.0, camera, lens)[1].any(axis=2)


def _write_passes(passes: Passes, path: Path) -> tuple[str, ...]:
    """Write what there is beside an image's `path`, and say what that is."""
    beside = {kind: path.with_name(f"{path.name}_{kind}.exr") for kind in ("depth", "normal", "albedo")}
    if passes.depth is not None:
        write_channels(beside["depth"], {"Z": passes.depth})
    if passes.normal is not None:
        write_channels(beside["normal"], dict(zip("XYZ", np.moveaxis(passes.normal, 2, 0), strict=True)))
    if passes.albedo is not None:
        write_image(beside["albedo"], passes.albedo)
    return tuple(kind for kind in beside if getattr(passes, kind) is not None)
