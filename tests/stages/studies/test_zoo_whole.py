"""A room of the zoo that Blender renders and that cannot be trained: the study ends with a row that says so."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pandas as pd
import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.graph.pipeline import run
from rgspipe.stages import load_stage

#: One view with hardly any depth leaves nothing to make surfels of.
BLIND = (
    'study.cases=["blind: capture.depth_missing=0.99 capture.views=1"]',
    "study.zoo.seeds=[3]",
    "study.zoo.fewest_views=4",
    "study.zoo.most_views=4",
    "study.views=[1]",
    "scene.zoo.plan=box",
    "dataset.resolution=24",
    "dataset.test_views=1",
    "dataset.samples=1",
    "dataset.test_samples=1",
)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("bpy") is None, reason="bpy is not installed")
def test_a_room_that_cannot_be_trained_is_no_end_of_the_study(tmp_path: Path) -> None:
    config = compose_config(["stage=study", "experiment=zoo", f"outputs={tmp_path / 'outputs'}", *BLIND])
    study = run(config, load_stage)
    table = pd.read_csv(study.file("study.csv"))
    assert table["occlusion"].tolist() == ["visible", "out_of_frame", "occluded"] and not table["success"].any()
    assert set(table["failed_in"]) == {"init_depth"} and table["reason"].str.contains("depth pixels").all()
    # What Blender made is known all the same; lenses of a room differ by a tenth.
    assert table["lens"].between(27.0, 82.5).all() and table["held_out_psnr"].isna().all()
    assert table["train_views"].tolist() == [1] * 3 and table["plan"].tolist() == ["box"] * 3
    assert "### Rooms that failed" in study.file("study.md").read_text()
