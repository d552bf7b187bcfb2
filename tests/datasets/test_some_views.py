"""Some views of a dataset: held-out ones first, the others evenly chosen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.location import point_at_dataset
from rgspipe.datasets.some_views import some_views
from rgspipe.errors import InputError
from tiny_dataset import HEIGHT, WIDTH, tiny_camera, tiny_light


@pytest.fixture
def counted(dataset: Path) -> Path:
    """Of three held-out views and six to train on."""
    for split, count in (("test", 3), ("train", 6)):
        names = [f"{split}/r_{index}" for index in range(count)]
        for name in names:
            write_image(
                dataset / f"{name}.exr", 0.25 * np.ones((HEIGHT, WIDTH, 3), np.float32), np.ones((HEIGHT, WIDTH))
            )
        entries = [frame_entry(name, tiny_camera(), tiny_light()) for name in names]
        write_transforms(dataset / f"transforms_{split}.json", entries)
    return dataset


@pytest.mark.parametrize(
    ("most", "names"),
    [
        (2, ["test/r_0", "test/r_1"]),
        (3, ["test/r_0", "test/r_1", "test/r_2"]),
        (5, ["test/r_0", "test/r_1", "test/r_2", "train/r_0", "train/r_3"]),
    ],
)
def test_held_out_views_come_first(counted: Path, most: int, names: list[str]) -> None:
    views, count = some_views(counted, most)
    assert [view.name for view in views] == names and count == 9


def test_images_of_others_are_not_read(counted: Path) -> None:
    for name in ("train/r_1", "train/r_2", "train/r_4", "train/r_5"):
        (counted / f"{name}.exr").write_bytes(b"damaged")
    assert len(some_views(counted, 5)[0]) == 5
    with pytest.raises(InputError, match="r_1"):
        some_views(counted, 9)


def test_where_none_are_held_out_those_of_training_are_there(counted: Path, tmp_path: Path) -> None:
    (counted / "transforms_test.json").unlink()
    (tmp_path / "artifact").mkdir()
    point_at_dataset(tmp_path / "artifact", counted)
    views, count = some_views(tmp_path / "artifact", 40)
    assert [view.name for view in views] == [f"train/r_{index}" for index in range(6)] and count == 6
