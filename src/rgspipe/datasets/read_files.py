"""Which files reading a dataset or a fit target depends on, wherever they lie."""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.frames import read_entries
from rgspipe.datasets.input_file import input_folder

#: The files that name images, in the folder of a dataset and in that of a target.
TRANSFORMS = ("transforms_train.json", "transforms_test.json", "transforms.json", "targets/*/transforms.json")

#: What is read beside the folder of a target.
BESIDE = ("targets.json", "../dataset_info.json")


def files_read(folder: str | Path) -> list[Path]:
    """The folder of a dataset or of a fit target, and the files elsewhere that it refers to.

    Raises:
        InputError: there is no such folder, or a transforms file in it is broken.
    """
    folder = input_folder(folder, "a folder with images and their cameras")
    transforms = [path for pattern in TRANSFORMS for path in sorted(folder.glob(pattern))]
    named = [path for part in transforms for entry in read_entries(part, "cameras") for path in entry.files]
    elsewhere = [path for path in named if not path.is_relative_to(folder) or ".." in path.parts]
    if (folder / "transforms.json").exists():
        elsewhere += [folder.parent / name for name in BESIDE]
    return [folder, *dict.fromkeys(path for path in elsewhere if path.is_file())]
