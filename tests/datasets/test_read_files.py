"""Every file that is read is known beforehand, so that a changed one is noticed, wherever it lies."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rgspipe.datasets.gs3 import TargetFolder, load_dataset, load_target
from rgspipe.datasets.read_files import files_read
from rgspipe.errors import InputError
from rgspipe.store.files import tree_digest

Change = Callable[[str, Callable[[dict], object]], None]


def _digests(root: Path) -> list[str]:
    return [tree_digest(path) for path in files_read(root)]


@pytest.mark.parametrize("form", ["relative", "absolute"])
def test_an_image_outside_of_the_dataset_counts(dataset: Path, change: Change, tmp_path: Path, form: str) -> None:
    outside = tmp_path / "elsewhere" / "image.exr"
    outside.parent.mkdir()
    shutil.move(dataset / "train/r_0000.exr", outside)
    name = "../elsewhere/image.exr" if form == "relative" else str(outside)
    change("transforms_train.json", lambda content: content["frames"][0].update(file_path=name))
    load_dataset(dataset)
    before = _digests(dataset)
    shutil.copy(dataset / "train/r_0000_albedo.exr", outside)
    assert _digests(dataset) != before


def test_an_image_behind_a_linked_folder_counts(dataset: Path, tmp_path: Path) -> None:
    shutil.move(dataset / "train", tmp_path / "images")
    (dataset / "train").symlink_to(tmp_path / "images")
    (tmp_path / "images/circle").symlink_to(tmp_path / "images")
    load_dataset(dataset)
    before = _digests(dataset)
    shutil.copy(tmp_path / "images/r_0000_albedo.exr", tmp_path / "images/r_0000.exr")
    assert _digests(dataset) != before


def test_what_is_read_beside_a_target_counts(dataset: Path) -> None:
    before = _digests(dataset / "targets/one")
    text = (dataset / "targets/targets.json").read_text()
    (dataset / "targets/targets.json").write_text(text.replace("visible", "hidden"))
    assert _digests(dataset / "targets/one") != before


def test_a_target_has_the_name_of_its_folder_however_it_is_reached(
    dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(dataset / "targets/one")
    (dataset / "targets/one/sub").mkdir()
    for folder in (".", "sub/..", dataset / "targets/one", "../one"):
        target = load_target(folder)
        assert (target.name, target.occlusion) == ("one", "visible")


@pytest.mark.parametrize("name", [".hidden", "results.csv", "manifest.json", "n" * 220])
def test_a_name_that_no_result_can_have_is_refused_before_anything_is_made(dataset: Path, name: str) -> None:
    shutil.move(dataset / "targets/one", dataset / "targets" / name)
    with pytest.raises(InputError, match="not hidden"):
        load_target(dataset / "targets" / name)


@pytest.mark.parametrize("name", ["n" * 5000, ".one", "a/b", "..", "a\\u0000b"])
def test_a_listed_name_that_is_no_folder_is_refused(dataset: Path, name: str) -> None:
    (dataset / "targets/targets.json").write_text(f'{{"targets": [{{"name": "{name}"}}]}}')
    with pytest.raises(InputError, match=r"targets\.json.*name"):
        load_dataset(dataset)


def test_a_target_that_is_listed_twice_is_refused(dataset: Path) -> None:
    twice = [{"name": "one", "occlusion": "visible"}, {"name": "one", "occlusion": "occluded"}]
    (dataset / "targets/targets.json").write_text(json.dumps({"targets": twice}))
    with pytest.raises(InputError, match=r"targets\[1\]\.name: expected each target once, found 'one'"):
        load_target(dataset / "targets/one")


def test_a_target_that_is_a_loop_of_links_is_refused(tmp_path: Path) -> None:
    (tmp_path / "one").symlink_to("one")
    with pytest.raises(InputError, match="symbolic links"):
        TargetFolder.of(tmp_path / "one")
