"""COLMAP: a sparse model as text or binary, `images/`, and depth maps, which it does not make by itself.

Its poses take the world to the camera, with OpenCV axes. Its unit is its own: without depth that was measured, a scene
has no metres, and without any depth there are no surfaces.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rgspipe.datasets.input_file import is_there
from rgspipe.datasets.json_file import numbers, read_json, required
from rgspipe.datasets.scans.colmap_model import ColmapImage, read_cameras, read_images
from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import from_quaternion, placed
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "sparse/0/ (or sparse/, colmap/, or the folder itself) with cameras and images, .bin or .txt"

#: Where models may be (several have numbers), and photographs: as large as can be had, as datasets have them in smaller
#: copies, and in folders of ScanNet++.
NUMBERED, MODELS = "sparse", ("sparse", ".", "colmap")
RESIZED = "resized_images"
IMAGES = ("images", ".", "images_2", "images_4", "images_8", RESIZED, "rgb")

#: Where depth of a photograph may be; {name} is that of its file, {stem} without suffix.
DEPTHS = (
    *(f"{folder}/{{stem}}{suffix}" for folder in ("depth", "depths") for suffix in (".png", ".exr", ".npy")),
    "stereo/depth_maps/{name}.geometric.bin",
    "stereo/depth_maps/{name}.photometric.bin",
)

#: Where ScanNet++ has what of its resized photographs is not to be used.
MASKS = "resized_anon_masks/{stem}.png"

#: Beside a model: by which scale and offset 3D Gaussian Splatting takes levels of depth for 1 over it, and by how many
#: times their median a scale may be off before that is not believed there.
DISPARITIES, BELIEVED = "depth_params.json", 5.0

MILLIMETRE = 1e-3

#: The files of a model, and what is in them.
_Model = tuple[Path, Path, dict[int, Lens], list[ColmapImage]]


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return bool(_models(root))


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all photographs.

    Raises:
        InputError: broken files, or a lens that is not known.
    """
    models = _models(root)
    if not models:
        raise InputError(root, expected=WANTED, found="no model", remedy="Run colmap mapper, or correct the path.")
    whole, broken = _read(models)
    cameras_path, images_path, cameras, photographs = max(whole, key=lambda model: len(model[-1]))
    disparities = _disparities(cameras_path.with_name(DISPARITIES))
    folder = next((root / name for name in IMAGES if is_there(root / name / photographs[0].name)), root / IMAGES[0])
    # The order of the file is that of registration.
    ordered = sorted(photographs, key=lambda one: one.name)
    frames = tuple(_frame(one, cameras, root, folder, images_path, options, disparities) for one in ordered)
    notes = ["lengths are in the model's own unit, which is metres only if it was scaled (ScanOptions.pose_unit)"]
    notes += [f"a model is left out, as it cannot be read: {error}" for error in broken]
    if len(whole) > 1:
        notes.append(
            f"of {len(whole)} models, which share no coordinates, the largest is taken: {images_path.parent.name} "
            f"with {len(photographs)} of {sum(len(model[-1]) for model in whole)} photographs"
        )
    if disparities is not None:
        notes.append(f"depth is predicted: 1 over the levels by {DISPARITIES}")
    sources = (cameras_path, images_path, *([] if disparities is None else [cameras_path.with_name(DISPARITIES)]))
    return Scan("colmap", images_path, sources, frames, options.camera_axes(AXES), tuple(notes))


def _read(models: list[tuple[Path, Path]]) -> tuple[list[_Model], list[InputError]]:
    """Models with what is in their files, and what is wrong with others beside them.

    Raises:
        InputError: none can be read; what is wrong with the first.
    """
    whole, broken = [], []
    for cameras, images in models:
        try:
            whole.append((cameras, images, read_cameras(cameras), read_images(images)))
        except InputError as error:
            broken.append(error)
    if not whole:
        raise broken[0]
    return whole, broken


def _models(root: Path) -> list[tuple[Path, Path]]:
    """Cameras and images of the model, or of each of several by number."""
    numbered = [path for path in (root / NUMBERED).glob("*") if path.name.isdecimal()]
    several = [pair for path in sorted(numbered, key=lambda path: int(path.name)) if (pair := _model(path))]
    return several or [pair for place in MODELS if (pair := _model(root / place))][:1]


def _model(folder: Path) -> tuple[Path, Path] | None:
    for suffix in (".bin", ".txt"):
        cameras, images = (folder / f"{name}{suffix}" for name in ("cameras", "images"))
        if cameras.is_file() and images.is_file():
            return cameras, images
    return None


def _disparities(path: Path) -> dict[str, tuple[float, float]] | None:
    """Scale and offset by a photograph's name without suffix, as far as they are believed; None without a file.

    Raises:
        InputError: the file holds anything else.
    """
    if not path.is_file():
        return None
    content = read_json(path, "scale and offset of each photograph's depth")
    found = {}
    for name, stated in content.items():
        where = f"{path}: {name}"
        stated = stated if isinstance(stated, dict) else {}
        scale, offset = (numbers([required(stated, key, where)], 1, where, key)[0] for key in ("scale", "offset"))
        if scale > 0.0:
            found[name] = scale, offset
    usual = float(np.median([scale for scale, _ in found.values()])) if found else 1.0
    return {name: pair for name, pair in found.items() if 1.0 / BELIEVED <= pair[0] / usual <= BELIEVED}


def _frame(
    photograph: ColmapImage,
    cameras: Mapping[int, Lens],
    root: Path,
    folder: Path,
    where: Path,
    options: ScanOptions,
    disparities: Mapping[str, tuple[float, float]] | None,
) -> ScanFrame:
    if photograph.camera not in cameras:
        found = f"camera {photograph.camera} of {photograph.name}, which the model lacks"
        raise InputError(where, expected="a camera for each image", found=found, remedy="Copy the whole model.")
    mask = root / MASKS.format(stem=_stem(photograph.name))
    matrix = np.eye(4)
    rotation = from_quaternion(photograph.quaternion).T
    matrix[:3, :3], matrix[:3, 3] = rotation, -rotation @ photograph.translation
    return ScanFrame(
        image=folder / photograph.name,
        lens=cameras[photograph.camera],
        pose=placed(matrix, f"{where}: {photograph.name}", options, AXES),
        depth=_depth(root, photograph.name, options, disparities),
        mask=mask if folder.name == RESIZED and is_there(mask) else None,
        size_stated=True,
    )


def _stem(name: str) -> str:
    return Path(name).with_suffix("").as_posix()


def _depth(
    root: Path, name: str, options: ScanOptions, disparities: Mapping[str, tuple[float, float]] | None
) -> DepthImage | None:
    stem = _stem(name)
    path = next((path for place in DEPTHS if is_there(path := root / place.format(name=name, stem=stem))), None)
    if path is None:
        return None
    own = 1.0 if options.pose_unit is None else options.pose_unit  # of the model
    if disparities is not None and path.suffix == ".png":
        return DepthImage(path, own, disparity=disparities[stem]) if stem in disparities else None
    usual = MILLIMETRE if path.suffix == ".png" else own
    return DepthImage(path, usual if options.depth_unit is None else options.depth_unit)
