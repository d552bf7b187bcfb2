"""A room of the zoo from Blender to the table, as small as it goes, beside one that cannot be trained."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.pipeline import run
from rgspipe.stages import load_stage

#: About 20 s.
TINY = (
    "study.zoo.seeds=[3]",
    "study.zoo.fewest_views=4",
    "study.zoo.most_views=4",
    "study.views=[1]",
    "scene.zoo.plan=box",
    "dataset.resolution=24",
    "dataset.test_views=1",
    "dataset.samples=1",
    "dataset.test_samples=1",
    "init.surfels=300",
    "train.rounds=1",
    "train.steps=3",
    "train.gather_rays=16",
    "train.patches=40",
    "freeze.gather_rays=16",
    "freeze.patches=40",
    "freeze.dictionary_grid=4",
)


@pytest.mark.slow
def test_a_room_goes_the_whole_way_and_one_that_cannot_be_trained_is_a_row(tmp_path: Path) -> None:
    # Depth that is missing nearly everywhere leaves nothing to make surfels of.
    cases = 'study.cases=[clean,"blind: capture.depth_missing=0.99 capture.views=1"]'
    config = compose_config(["stage=study", "experiment=zoo", f"outputs={tmp_path / 'outputs'}", *TINY, cases])
    study = run(config, load_stage)
    table = pd.read_csv(study.file("study.csv"))
    whole, blind = table[table["case"] == "clean"], table[table["case"] == "blind"]
    assert set(whole["occlusion"]) == {"visible", "out_of_frame", "occluded"} and len(whole) == 3
    assert whole["held_out_psnr"].notna().all() and whole["failed_in"].isna().all()
    assert whole["train_views"].tolist() == [4] * 3 and whole["lens"].between(25.0, 85.0).all()
    assert whole["grade"].isin(["good", "fair", "poor"]).all() and whole["unseen"].between(0.0, 1.0).all()
    print(blind[["failed_in", "reason", "train_views"]].to_string())
    assert study.file("study.png").read_bytes().startswith(b"\x89PNG")
