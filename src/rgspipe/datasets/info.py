"""dataset_info.json: what the images of a dataset mean."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rgspipe.datasets.json_file import read_json, required, shown
from rgspipe.errors import InputError

VERSION = 1

#: Its name in the folder of a dataset or of a target.
INFO = "dataset_info.json"

#: The depth conventions and what they say.
DEPTH_CONVENTIONS = {
    "planar_z": "distance along the camera's axis, as Blender's Z pass",
    "ray_distance": "distance along each pixel's ray",
}


@dataclass(frozen=True)
class DatasetInfo:
    """The content of dataset_info.json that reading the images depends on."""

    path: Path
    depth_convention: str | None

    def require_depth_convention(self) -> str:
        """The depth convention, or an InputError that shows both."""
        if self.depth_convention is None:
            raise _convention_error(self.path, 'no "depth_convention"')
        return self.depth_convention


def read_info(root: Path) -> DatasetInfo | None:
    """dataset_info.json of the dataset in `root`; None if there is none.

    Raises:
        InputError: another version, an unknown depth convention, or images that are not premultiplied.
    """
    path = root / INFO
    if not path.exists():
        return None
    content = read_json(path, "what the dataset's images mean")
    version = required(content, "version", path)
    if version != VERSION:
        raise InputError(path, expected=f'"version": {VERSION}', found=repr(version), remedy="Convert the dataset.")
    alpha = content.get("image_alpha", "premultiplied")
    if alpha != "premultiplied":
        raise InputError(
            f"{path}: image_alpha",
            expected='"premultiplied", as Blender writes it',
            found=repr(alpha),
            remedy="Multiply the colours by alpha.",
        )
    convention = content.get("depth_convention")
    if convention is not None and convention not in list(DEPTH_CONVENTIONS):
        raise _convention_error(path, shown(convention))
    return DatasetInfo(path, convention)


def _convention_error(path: Path, found: str) -> InputError:
    both = " or ".join(f'"depth_convention": "{name}" ({meaning})' for name, meaning in DEPTH_CONVENTIONS.items())
    return InputError(path, expected=both, found=found, remedy="Add the one that the depth images were written with.")
