"""Read datasets and fit targets in the GS³ / NRHints format; see docs/reference/formats.md.

Whatever is wrong with the files is an InputError that names the file and the key: nothing that is
broken, missing or ambiguous gets past this module.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from rgspipe.datasets.base_images import base_paths, read_base
from rgspipe.datasets.classes import OCCLUSIONS
from rgspipe.datasets.exif_exposure import EXPOSE_ALIKE, check_exposures, exposure_of
from rgspipe.datasets.frames import FrameEntry, read_entries
from rgspipe.datasets.image_names import check_once
from rgspipe.datasets.images import read_colour, read_depth, read_mask, read_vectors
from rgspipe.datasets.info import INFO, DatasetInfo, read_info
from rgspipe.datasets.input_file import input_folder, is_plain_name
from rgspipe.datasets.json_file import read_json, required, shown
from rgspipe.datasets.missing_files import missing_of, named
from rgspipe.datasets.name_order import name_order
from rgspipe.datasets.saturation import with_saturation
from rgspipe.datasets.tensoir import is_tensoir, load_tensoir
from rgspipe.datasets.views import Dataset, Target, View
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar
from rgspipe.scene import Camera, PointLight

#: Files of a result, beside the folders of targets.
TAKEN = ("results.csv", "manifest.json")

#: The views that are left out of training; a dataset can do without.
TEST = "transforms_test.json"


def load_dataset(root: str | Path, *, train: bool = True, test: bool = True, targets: bool = True) -> Dataset:
    """Read the wanted parts of the dataset in the folder `root`; what is not wanted is empty.

    A dataset without targets/ has no targets, and one without transforms_test.json no views that are left out. A folder
    of TensoIR is read as what it is.

    Raises:
        InputError: any file is missing, broken or inconsistent.
    """
    root = input_folder(root, "the folder of a dataset")
    if is_tensoir(root):
        return load_tensoir(root, train=train, test=test)
    info = read_info(root)
    splits = {"train": train, "test": test and (root / TEST).exists()}
    if all(splits.values()):
        _check_held_out(root)
    loaded = {name: load_split(root, name, info) if wanted else () for name, wanted in splits.items()}
    return Dataset(root, loaded["train"], loaded["test"], _load_targets(root) if targets else ())


def _check_held_out(root: Path) -> None:
    """Refuse views that are held out and trained on: they would flatter the scene."""
    trained = {os.path.normpath(entry.image_path) for entry in split_entries(root, "train")}
    for entry in split_entries(root, "test"):
        if os.path.normpath(entry.image_path) in trained:
            raise InputError(
                f"{entry.where}.file_path",
                expected="views that are held out, which the scene is judged by",
                found=f"{entry.image_path}, which transforms_train.json has, too",
                remedy="Take its frame out of one of the two files.",
            )


def load_split(root: Path, split: str, info: DatasetInfo | None) -> tuple[View, ...]:
    """The views of transforms_<split>.json, each with its light; without lights where no frame names one.

    Raises:
        InputError: a file is missing, broken or inconsistent, or images under known lights state other exposures.
    """
    return load_entries(split_entries(root, split), root, split, info)


def split_entries(root: Path, split: str) -> list[FrameEntry]:
    """The frames of transforms_<split>.json, whose images are still to be read.

    Raises:
        InputError: the file is missing, broken or inconsistent.
    """
    what = f"the cameras and lights of the {split} views, laid out as docs/guides/your_own_scene.md says"
    entries = read_entries(root / f"transforms_{split}.json", what)
    check_once([entry.image_path for entry in entries], entries[0].transforms_path)
    return entries


def load_entries(entries: list[FrameEntry], root: Path, split: str, info: DatasetInfo | None) -> tuple[View, ...]:
    """The views of all or some of the frames of transforms_<split>.json, as `load_split` has them.

    Raises:
        InputError: a file is missing, broken or inconsistent, or images under known lights state other exposures.
    """
    _refuse_missing(entries)
    lit = any(entry.names_light for entry in entries)
    reading = progress_bar(entries, f"reading {split} views", unit="view")
    views = [_load_view(entry, root, info, light=lit, depth=True) for entry in reading]
    if lit:
        check_exposures([(view.name, view.exposure) for view in views], root / f"transforms_{split}.json", EXPOSE_ALIKE)
    return with_saturation(entries, views)


def _refuse_missing(entries: list[FrameEntry]) -> None:
    """Refuse frames whose files are not all there, all of them at once."""
    lacking = [paths for entry in entries if (paths := missing_of(entry.files))]
    if lacking:
        count = f"{len(lacking)} of {len(entries)} frames"
        raise InputError(
            entries[0].transforms_path,
            expected="all images of its frames",
            found=f"{named([path for paths in lacking for path in paths])}: no such file ({count})",
            remedy="Check the paths, copy the images there, or take these frames out of the file.",
        )


def load_target(folder: str | Path, base: str | Path | None = None) -> Target:
    """A fit target: a folder with transforms.json (cameras only) and its images.

    Its class is looked up in targets.json beside the folder; without that it is "unknown".

    Args:
        base: a folder with the same views with the lamps off, see `base_images`; what the frames name if None.

    Raises:
        InputError: the folder has no frames or images, or any file is broken or inconsistent.
    """
    folder = input_folder(folder, "the folder of a fit target")
    # "." and "DIR/sub/.." have names, too.
    place = folder.resolve() if folder.name in ("", "..") else folder
    _check_name(place.name, folder)
    occlusion = _listed_targets(place.parent).get(place.name, "unknown")
    entries = read_entries(folder / "transforms.json", "the cameras of a fit target")
    entries[0].refuse_other_world()
    check_once([entry.image_path for entry in entries], entries[0].transforms_path)
    info = _target_info(folder, place)
    pairs = zip(entries, base_paths(entries, base), strict=True)
    views = [_load_view(entry, folder, info, light=False, depth=False, base=path) for entry, path in pairs]
    return Target(place.name, occlusion, with_saturation(entries, views))


def _target_info(folder: Path, place: Path) -> DatasetInfo | None:
    """What the target's images mean: as it says itself, or else the dataset that it is a target of."""
    own = read_info(folder)
    return read_info(place.parent.parent) if own is None and place.parent.name == "targets" else own


@dataclass(frozen=True)
class TargetFolder:
    """A fit target whose images were not read.

    Attributes:
        views: how many it has.
    """

    name: str
    occlusion: str
    views: int

    @classmethod
    def of(cls, folder: str | Path) -> TargetFolder:
        """What `load_target` would read.

        Raises:
            InputError: it has no frames, or they are broken.
        """
        place = input_folder(folder, "the folder of a fit target").resolve()
        entries = read_entries(place / "transforms.json", "the cameras of a fit target")
        return cls(place.name, _listed_targets(place.parent).get(place.name, "unknown"), len(entries))


def target_folders(root: str | Path) -> list[Path]:
    """The folders of the fit targets of the dataset in `root`, as `load_dataset` reads them."""
    folder = Path(root) / "targets"
    if not folder.is_dir():
        return []
    listed = _listed_targets(folder)
    there = (path.name for path in folder.iterdir() if path.is_dir() and not path.name.startswith("."))
    names: Iterable[str] = listed or sorted(there, key=name_order)
    return [folder / name for name in names]


def _load_targets(root: Path) -> tuple[Target, ...]:
    return tuple(load_target(folder) for folder in progress_bar(target_folders(root), "reading targets", unit="target"))


def _listed_targets(folder: Path) -> dict[str, str]:
    """The names and classes of targets.json in `folder`; empty if there is no such file."""
    path = folder / "targets.json"
    if not path.exists():
        return {}
    listed = required(read_json(path, "the list of fit targets"), "targets", path)
    classes = {}
    for index, item in enumerate(listed if isinstance(listed, list) else [listed]):
        place = f"{path}: targets[{index}]"
        if not isinstance(item, dict):
            raise InputError(place, expected='{"name": …, "occlusion": …}', found=repr(item)[:80], remedy="Correct it.")
        name, occlusion = required(item, "name", place), item.get("occlusion", "unknown")
        _check_name(name, f"{place}.name")
        if occlusion not in OCCLUSIONS:
            expected = ", ".join(OCCLUSIONS)
            raise InputError(f"{place}.occlusion", expected=expected, found=repr(occlusion), remedy="Correct it.")
        if name in classes:
            raise InputError(f"{place}.name", expected="each target once", found=shown(name), remedy="Leave one.")
        classes[name] = occlusion
    return classes


def _check_name(name: object, where: str | Path) -> None:
    """Refuse names that the folder of a result cannot have: hidden ones are not published."""
    if not is_plain_name(name) or name in TAKEN:
        expected = f"the name of a folder that is not hidden, nor {' or '.join(TAKEN)}"
        raise InputError(where, expected=expected, found=shown(name), remedy="Rename the folder of the target.")


@dataclass(frozen=True)
class _Surface:
    """The optional images of a view's surfaces."""

    depth: torch.Tensor | None
    normal: torch.Tensor | None
    albedo: torch.Tensor | None


def _load_view(
    entry: FrameEntry,
    root: Path,
    info: DatasetInfo | None,
    *,
    light: bool,
    depth: bool,
    base: Path | None = None,
) -> View:
    """A view; it must name its `light`, and say what its `depth` means if it has any."""
    image, alpha = read_colour(entry.image_path)
    camera = entry.camera(image.shape[1], image.shape[0])
    mask = None if entry.mask_path is None else read_mask(entry.mask_path, camera)
    if mask is not None:
        _check_mask(entry.mask_path, mask)
        image, alpha = image * mask[..., None], alpha * mask
    surface = _load_surface(entry, camera, info, needed=depth)
    view = View(
        _name(entry.image_path, root),
        camera,
        image,
        alpha,
        PointLight(*entry.light()) if light else None,
        surface.depth,
        surface.normal,
        surface.albedo,
        emitters=None if entry.emitter_path is None else read_mask(entry.emitter_path, camera) >= 0.5,
        lighting=entry.lighting,
        exposure=exposure_of(entry.image_path),
    )
    if base is None:
        return view
    return replace(view, base=read_base(base, camera, mask), base_exposure=exposure_of(base))


def _check_mask(path: Path, mask: torch.Tensor) -> None:
    if not mask.any():
        expected, remedy = "a mask that is white where pixels count", "Invert it, or leave the frame out."
        raise InputError(path, expected=expected, found="black everywhere", remedy=remedy)


def _name(path: Path, root: Path) -> str:
    """The image below `root`, without suffix; only its own name if it lies elsewhere."""
    return path.relative_to(root).with_suffix("").as_posix() if path.is_relative_to(root) else path.stem


def _load_surface(entry: FrameEntry, camera: Camera, info: DatasetInfo | None, needed: bool) -> _Surface:
    depth = None
    # What a target's depth holds need not be said: no fit asks for it.
    if entry.depth_path is not None and (needed or (info is not None and info.depth_convention is not None)):
        if info is None:
            raise InputError(
                entry.transforms_path.parent / INFO,
                expected='a file that says what the depth images hold, with "depth_convention": "planar_z" or '
                '"depth_convention": "ray_distance"',
                found="no such file",
                remedy='Write it: {"version": 1, "depth_convention": "planar_z"} if depth is measured along the '
                "camera's axis (Blender's Z pass), \"ray_distance\" if along each pixel's ray.",
            )
        depth = read_depth(entry.depth_path, camera, info.require_depth_convention())
    normal = read_vectors(entry.normal_path, ("X", "Y", "Z"), camera) if entry.normal_path else None
    albedo = read_vectors(entry.albedo_path, ("R", "G", "B"), camera) if entry.albedo_path else None
    return _Surface(depth, normal, albedo)
