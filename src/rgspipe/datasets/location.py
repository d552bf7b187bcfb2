"""Where the files of a dataset artifact are: in it, or in the user's folder that it points at."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from rgspipe.datasets.gs3 import load_dataset, load_target
from rgspipe.datasets.input_file import input_folder
from rgspipe.datasets.json_file import read_json, required
from rgspipe.datasets.views import Dataset, View
from rgspipe.errors import InputError
from rgspipe.store.files import write_json

POINTER = "dataset.json"

#: In a dataset that was rendered under lamps that are not known: where they were.
LAMPS_TRUTH = "truth/lamps.json"

#: In a dataset of a .blend file: the file's own cameras, by name.
OWN_CAMERAS = "cameras.json"

#: What a folder of a fit target has, and one of a dataset has not.
TARGET = "transforms.json"


def dataset_root(folder: str | Path) -> Path:
    """The folder of the dataset that `folder` is, or points at."""
    pointer = Path(folder) / POINTER
    if not pointer.exists():
        return Path(folder)
    root = required(read_json(pointer, "the folder of a dataset"), "root", pointer)
    if not isinstance(root, str):
        raise InputError(f"{pointer}: root", expected="a path", found=repr(root), remedy="Make the artifact again.")
    return Path(root)


def point_at_dataset(folder: Path, root: Path) -> None:
    """Make `folder` point at the dataset in `root`."""
    write_json(folder / POINTER, {"root": str(root.resolve())})


def open_dataset(folder: str | Path, *, train: bool = True, test: bool = True, targets: bool = True) -> Dataset:
    """`load_dataset` of the dataset that `folder` is, or points at."""
    return load_dataset(dataset_root(folder), train=train, test=test, targets=targets)


def load_views(folder: str | Path, split: Literal["train", "test"] = "train") -> tuple[View, ...]:
    """The views of a dataset that are trained on, or held out; or those of a fit target.

    Args:
        folder: of a dataset, of what the stage generate_dataset made, or of a fit target.
        split: which of a dataset's views.

    Raises:
        InputError: any file is missing, broken or inconsistent.
    """
    folder = input_folder(folder, "a folder with images and their cameras")
    if split not in ("train", "test"):
        remedy = "Correct it."
        raise InputError("split", expected="train or test", found=repr(split)[:80], remedy=remedy)
    if (folder / TARGET).exists():
        return load_target(folder).views
    dataset = open_dataset(folder, train=split == "train", test=split == "test", targets=False)
    return dataset.train if split == "train" else dataset.left_out()
