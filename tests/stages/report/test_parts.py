"""What a report takes from the dataset."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd

from rgspipe.datasets.light_file import write_lights
from rgspipe.stages.report.gallery import dataset_gallery
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from tiny_dataset import tiny_light

NO_TARGETS = pd.DataFrame(columns=["method", "views", "target", "position_error"])


def _build(root: Path, key: Key, write) -> Artifact:
    def make(folder: Path) -> dict:
        write(folder)
        return {}

    recipe = {"config": {}, "inputs": {}, "code": {}}
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
