"""Which targets are known before anything is made, and which of their views are asked for."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from raycast import room_views
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.gs3_write import write_target_list
from rgspipe.errors import InputError
from rgspipe.stages.lights import fit_light
from rgspipe.stages.lights.targets import known_targets, masked_out
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


def test_masks_that_leave_most_of_the_scene_out_are_told() -> None:
    """Masks that are the wrong way round passed without a word; those of a thing before nothing leave nothing out."""
    kept = torch.ones(12, 12)
    kept[:3] = 0.0
    views = [replace(view, alpha=kept) for view in room_views(2, 12)]
    everywhere = [torch.ones(144)] * 2
    assert masked_out("evening", views, everywhere) == ""
    inverted = [replace(view, alpha=1.0 - kept) for view in views]
    line = masked_out("evening", inverted, everywhere)
    assert line.startswith("target evening: masks or alpha leave out 75 % of what the scene shows")
    assert masked_out("evening", inverted, [(1.0 - kept).reshape(-1)] * 2) == ""
