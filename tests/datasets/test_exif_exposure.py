"""What photographs state of their exposure, and that none is taken for another one's."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL.TiffImagePlugin import IFDRational

from rgspipe.datasets.exif_exposure import exposure_of
from rgspipe.datasets.gs3 import load_split, load_target
from rgspipe.datasets.info import read_info
from rgspipe.errors import InputError
from scan_layouts import write_exposed, write_photograph

Change = Callable[[str, Callable[[dict], object]], None]
TARGET = "targets/one/transforms.json"
GREY = np.full((4, 6, 3), 0.3)


def test_it_is_shutter_times_iso_over_aperture_squared(tmp_path: Path) -> None:
    write_exposed(tmp_path / "a.jpg", GREY, 0.02)
    assert exposure_of(tmp_path / "a.jpg") == pytest.approx(0.02 * 200 / 4)


def test_a_photograph_may_state_nothing(tmp_path: Path) -> None:
    write_photograph(tmp_path / "a.jpg", GREY)
    assert exposure_of(tmp_path / "a.jpg") is None and exposure_of(tmp_path / "a.exr") is None


@pytest.mark.parametrize("number", [IFDRational(0, 0), float("inf"), 0.0, 1e-30, 1e30])
def test_an_exposure_that_cannot_be_is_not_stated(tmp_path: Path, number: object) -> None:
    """Lenses without electronics may state an f-number of 0/0."""
    write_exposed(tmp_path / "a.jpg", GREY, 0.01, number)
    assert exposure_of(tmp_path / "a.jpg") is None


def _exposed(dataset: Path, change: Change, shutters: list[float]) -> None:
    """Training views as photographs, as many as shutters."""
    for index, shutter in enumerate(shutters):
        write_exposed(dataset / f"train/{index}.jpg", GREY, shutter)

    def edit(content: dict) -> None:
        frame = content["frames"][0]
        content["frames"] = [frame | {"file_path": f"train/{index}.jpg"} for index in range(len(shutters))]
        for other in content["frames"]:
            other.pop("file_ext", None)

    change("transforms_train.json", edit)


def test_training_views_that_state_other_exposures_are_refused(dataset: Path, change: Change) -> None:
    _exposed(dataset, change, [0.01, 0.0102, 0.01])
    first, second, _ = load_split(dataset, "train", read_info(dataset))
    assert second.exposure / first.exposure == pytest.approx(1.02)
    _exposed(dataset, change, [0.01, 0.04, 0.02])
    with pytest.raises(InputError, match=r"transforms_train\.json: .*found train/1 exposed 4 times as much as train/0"):
        load_split(dataset, "train", read_info(dataset))


def test_views_under_unknown_lamps_may_state_other_exposures(dataset: Path, change: Change) -> None:
    """Whether exposures are to be found is not known on reading."""
    _exposed(dataset, change, [0.01, 0.04])
    change("transforms_train.json", lambda content: [_unlit(frame) for frame in content["frames"]])
    first, second = load_split(dataset, "train", read_info(dataset))
    assert second.exposure / first.exposure == pytest.approx(4.0)


def _unlit(frame: dict) -> None:
    for key in ("pl_pos", "pl_intensity"):
        frame.pop(key)


def test_a_target_knows_what_it_and_its_base_state(dataset: Path, change: Change) -> None:
    folder = dataset / "targets/one"
    write_exposed(folder / "on.jpg", GREY, 0.01)
    write_exposed(folder / "off.jpg", GREY, 0.04)
    change(TARGET, lambda content: content["frames"][0].update(file_path="on.jpg", file_ext="", base_path="off.jpg"))
    (view,) = load_target(folder).views
    assert view.base_exposure / view.exposure == pytest.approx(4.0)
