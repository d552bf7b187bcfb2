"""What a report takes from the dataset, and from studies that have been made."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from rgspipe.artifacts import Artifact, ArtifactStore, Key
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.light_file import write_lights
from rgspipe.stages import report_study
from rgspipe.stages.report_gallery import dataset_gallery
from rgspipe.stages.report_study import found_study, study_file
from tiny_dataset import tiny_light

NO_TARGETS = pd.DataFrame(columns=["method", "views", "target", "position_error"])


def _build(root: Path, key: Key, write, judged: tuple[str, ...] = ()) -> Artifact:
    def make(folder: Path) -> dict:
        write(folder)
        return {}

    recipe = {"config": {}, "inputs": {"judge": list(judged)}, "code": {}}
    return ArtifactStore(root).build(key, recipe, make)[0]


def test_a_gallery_holds_views_targets_truth_errors_and_a_plan(tmp_path: Path, dataset: Path) -> None:
    write_lights(dataset / "truth" / "one.json", (tiny_light(),))
    made = _build(
        tmp_path, Key("tiny", "generate_dataset", "aa"), lambda f: shutil.copytree(dataset, f, dirs_exist_ok=True)
    )
    fits = [("search_lm", 3, 0.5), ("search_lm", 1, 0.0123), ("paper_adam", 1, 0.5)]
    targets = pd.DataFrame(fits, columns=["method", "views", "position_error"]).assign(target="one")
    gallery = dataset_gallery(made, None, targets)
    assert gallery.counts == "1 training view of 6 × 4 pixels, 1 held-out view, 1 target with 1 view each"
    assert len(gallery.train) == 1 and gallery.plan.startswith(b"\x89PNG")
    (visible,) = gallery.classes
    assert visible.name == "visible" and visible.count == 1
    assert (
        visible.shots[0].caption == "one: light at (0.10, 0.20, 0.30), 2.00 / 2.00 / 2.00 W/sr; recovered 1.23 % away"
    )


def test_without_a_dataset_there_is_no_gallery() -> None:
    assert dataset_gallery(None, None, NO_TARGETS) is None


@pytest.fixture
def days(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Artifacts that are made one after the other within a second are a day apart."""

    def newer(found: Artifact) -> str:
        return found.fingerprint

    monkeypatch.setattr(report_study, "_made", newer)
    yield


def _config(tmp_path: Path, scene: str) -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {"stage": "report", "scene.name": scene, "outputs": str(tmp_path)})


def _study(root: Path, folder: str, fingerprint: str, scenes: list[str], judged: str) -> Artifact:
    table = pd.DataFrame({"scene": scenes, "case": "clean", "psnr": range(len(scenes))})
    key = Key(folder, "study", fingerprint)
    return _build(root, key, lambda f: table.to_csv(f / "study.csv", index=False), (judged,))


def test_the_newest_study_of_a_scene_counts_wherever_it_lies(tmp_path: Path, days: None) -> None:
    _study(tmp_path, "room", "01", ["room"], "j1")
    newest = _study(tmp_path, "cornell", "02", ["cornell", "room", "room"], "j2")
    _study(tmp_path, "corner", "03", ["corner"], "j3")
    config = _config(tmp_path, "room")
    assert study_file(config) == [newest.path / "study.csv"]
    table, _ = found_study(config, ())
    assert table["psnr"].tolist() == [1, 2]
    assert study_file(_config(tmp_path, "hotdog")) == [] and found_study(_config(tmp_path, "hotdog"), ()) == (None, "")


def test_a_study_of_another_training_is_marked(tmp_path: Path) -> None:
    judged = _build(tmp_path, Key("room", "judge", "j1"), lambda folder: None)
    _study(tmp_path, "room", "01", ["room"], "j1")
    assert found_study(_config(tmp_path, "room"), [judged])[1] == ""
    _study(tmp_path, "room", "02", ["room"], "j2")
    assert "other settings" in found_study(_config(tmp_path, "room"), [judged])[1]
