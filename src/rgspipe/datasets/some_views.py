"""Some views of a dataset, to look at, where all of them would take long to read and much memory."""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.gs3 import TEST, load_entries, split_entries
from rgspipe.datasets.info import read_info
from rgspipe.datasets.input_file import input_folder
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.views import View


def some_views(folder: str | Path, most: int) -> tuple[tuple[View, ...], int]:
    """At most so many views of the dataset that `folder` is or points at, and how many it has.

    Held-out ones come first, then those that are trained on; where not all of either are taken, evenly chosen ones.

    Raises:
        InputError: any file that is read is missing, broken or inconsistent.
    """
    root = input_folder(dataset_root(folder), "the folder of a dataset")
    info, views, count = read_info(root), (), 0
    for split in ("test", "train") if (root / TEST).exists() else ("train",):
        entries = split_entries(root, split)
        kept, count = min(most - len(views), len(entries)), count + len(entries)
        chosen = [entries[index * len(entries) // kept] for index in range(kept)]
        views += load_entries(chosen, root, split, info)
    return views, count
