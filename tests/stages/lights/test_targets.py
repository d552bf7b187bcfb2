"""Which targets are known before anything is made, and which of their views are asked for."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.gs3_write import write_target_list
from rgspipe.errors import InputError
from rgspipe.stages.lights import fit_light
from rgspipe.stages.lights.targets import known_targets
from rgspipe.stages.report import report
from tiny_dataset import write_tiny_dataset


@pytest.fixture
def config(tmp_path: Path) -> RgspipeConfig:
    """A dataset from disk whose only target has one view."""
    write_tiny_dataset(tmp_path)
    changes = {"scene.kind": "external", "scene.path": str(tmp_path), "report.views": (1, 3)}
    return with_changes(RgspipeConfig(stage="report"), changes)


def test_views_that_targets_on_disk_lack_are_refused_before_a_scene_is_trained(config: RgspipeConfig) -> None:
    fit_light.STAGE.files(config)
    for changes in ({"views.count": 3}, {"views.indices": (1,)}):
        with pytest.raises(InputError, match=r"different cameras of the 1 that target one has"):
            fit_light.STAGE.files(with_changes(config, changes))


def test_a_report_asks_targets_on_disk_for_no_more_views_than_there_are(config: RgspipeConfig) -> None:
    asked = {need.changes["views.count"] for need in report.STAGE.needs(config) if need.stage == "fit_light"}
    assert asked == {1}


def test_targets_of_another_class_do_not_count(config: RgspipeConfig, tmp_path: Path) -> None:
    [known] = known_targets(config)
    assert (known.name, known.views) == ("one", 1)
    write_target_list(tmp_path, [("one", "visible")])
    with pytest.raises(InputError, match="a class that the dataset has targets of: visible"):
        known_targets(with_changes(config, {"occlusion": "occluded"}))
    shutil.rmtree(tmp_path / "targets")
    with pytest.raises(InputError, match=r"fit\.target: expected the folder of a target.*fit\.target=DIR"):
        known_targets(config)
    # Targets that are made here are not on disk yet.
    assert known_targets(with_changes(config, {"fit.targets": "generated"})) == []
