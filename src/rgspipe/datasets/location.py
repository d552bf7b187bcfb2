"""Where the files of a dataset artifact are: in it, or in the user's folder that it points at."""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.json_file import read_json, required
from rgspipe.datasets.views import Dataset
from rgspipe.errors import InputError
from rgspipe.files import write_json

POINTER = "dataset.json"


def dataset_root(folder: str | Path) -> Path:
    """The folder of the dataset that `folder` is, or points at."""
    pointer = Path(folder) / POINTER
    if not pointer.is_file():
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
