"""The study of the zoo: what it asks for, and what it makes of rooms that are there and of one that is not."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import torch

from lit_room import room_surfels
from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.grade_file import GRADE, save_grade
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.errors import InputError
from rgspipe.scene import Camera, look_at
from rgspipe.scene.grade import KnownLamps, SceneGrade
from rgspipe.stages.base import Failure, StageContext
from rgspipe.stages.studies import study
from rgspipe.stages.studies.zoo import STAGES
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key

ROWS = "target,occlusion,method,views,position_error,intensity_error,axis_error,shape_error,shape_kind,psnr,seconds,"
ROWS += "success,count_right,types_right,position_sd,inside_95,result,reason\n"
ROWS += "visible_000,visible,search_lm,{views},0.004,0.02,,,,30,0.5,True,True,True,0.004,True,converged,\n"
ROWS += "occluded_000,occluded,search_lm,{views},0.04,0.02,,,,30,0.5,False,True,True,0.01,False,converged,\n"


def _config(*overrides: str) -> RgspipeConfig:
    return compose_config(["stage=study", "experiment=zoo", "study.zoo.seeds=[4,7]", *overrides])


def test_every_room_is_rendered_trained_and_fitted_as_its_seed_says() -> None:
    needs = study.STAGE.needs(_config())
    assert [need.stage for need in needs[:4]] == list(STAGES) and len(needs) == 2 * 2 * 4
    assert all(need.may_fail for need in needs)
    first, last = needs[0].changes, needs[-1].changes
    assert (first["scene.zoo.seed"], first["scene.name"], last["scene.name"]) == (4, "zoo_4", "zoo_7")
    assert first["views.count"] == 1 and last["views.count"] == 3
    for changes in (first, last):
        assert 25 <= changes["dataset.train_views"] <= 100 and 0.0 <= changes["capture.image_noise"] <= 0.1
        assert changes["target_capture.noise"] == changes["capture.image_noise"]
        assert changes["capture.seed"] == changes["scene.zoo.seed"]
    assert first["capture.image_noise"] != last["capture.image_noise"]
    for need in needs:
        with_changes(_config(), need.changes)


def test_what_is_prepared_renders_three_lights_a_room_of_odd_seeds() -> None:
    config = compose_config(["stage=study", "experiment=zoo"])
    assert config.dataset.targets_per_class == 1 and all(seed % 2 for seed in config.study.zoo.seeds)
    assert (config.dataset.samples, config.dataset.test_samples) == (24, 64)


def test_cases_and_methods_are_beside_each_other_in_the_same_rooms() -> None:
    config = _config('study.cases=[clean,"open: train.unseen=false"]', "study.views=[3]")
    fits = [need.changes for need in study.STAGE.needs(config) if need.stage == "evaluate"]
    assert [changes.get("train.unseen") for changes in fits] == [None, False, None, False]
    assert fits[0]["capture.image_noise"] == fits[1]["capture.image_noise"]


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({"fewest_views": 60, "most_views": 50}, "study.zoo.most_views"),
        ({"least_noise": 0.2}, "study.zoo.most_noise"),
        ({"seeds": [3, 3]}, "study.zoo.seeds"),
    ],
)
def test_ranges_that_hold_nothing_and_rooms_twice_are_refused(changes: dict[str, object], wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        with_changes(RgspipeConfig(), {"study.kind": "zoo", "study.zoo": changes})


def _artifact(root: Path, stage: str, views: int) -> Artifact:
    def build(folder: Path) -> dict:
        if stage == "generate_dataset":
            pose = look_at(torch.tensor([0.0, 0.0, 0.0]), torch.tensor([0.0, 1.0, 0.0]))
            camera = Camera(pose, 64.0, 64.0, 64.0, 64.0, 128, 128)
            write_transforms(folder / "transforms_train.json", [frame_entry("train/r_0000", camera)])
        elif stage == "train_surfels":
            save_surfels(folder / "surfels.safetensors", room_surfels())
            (folder / "metrics.json").write_text(json.dumps({"test_psnr_mean": 33.0, "seconds": 80.0}))
        elif stage == "freeze":
            grade = SceneGrade(33.0, 4, residual=0.04, guessed=0.25, doubt=0.03, at_bound=0.0, missing=0.0)
            save_grade(folder / GRADE, replace(grade, lamps=KnownLamps(19, 0.015, 1.2)))
        else:
            (folder / "metrics.csv").write_text(ROWS.format(views=views))
        return {}

    recipe = {"config": {}, "inputs": {}, "code": {}}
    return ArtifactStore(root).build(Key("zoo_4", stage, f"{views:02x}"), recipe, build)[0]


def test_a_room_that_failed_is_a_row_with_its_reason(tmp_path: Path) -> None:
    lists = {stage: [_artifact(tmp_path, stage, views) for views in (1, 3)] for stage in STAGES}
    # Room 7 was rendered, and its training failed.
    lists["generate_dataset"] += lists["generate_dataset"]
    lost = dict.fromkeys((2, 3), Failure("train_surfels", "the loss is NaN"))
    failures = dict.fromkeys(STAGES[1:], lost)
    (tmp_path / "out").mkdir()
    inputs = {stage: found[0] for stage, found in lists.items()}
    study.run(StageContext(_config(), inputs, lists, tmp_path / "out", failures=failures))
    table = pd.read_csv(tmp_path / "out" / "study.csv")
    assert table["scene"].tolist() == ["zoo_4"] * 4 + ["zoo_7"] * 6 and set(table["kind"]) == {"zoo"}
    good, failed = table[table["seed"] == 4], table[table["seed"] == 7]
    assert good["silent"].tolist() == [False, True] * 2 and good["success"].tolist() == [True, False] * 2
    assert set(good["lens"]) == {90.0} and set(good["held_out_psnr"]) == {33.0} and set(good["unseen"]) == {0.0}
    assert set(good["grade"]) == {"fair"} and good["grade_error"].tolist() == pytest.approx([0.015] * 4)
    assert set(good["guessed"]) == {0.25} and failed["grade"].isna().all()
    assert set(failed["reason"]) == {"the loss is NaN"} and set(failed["failed_in"]) == {"train_surfels"}
    assert failed["lens"].tolist() == [90.0] * 6 and failed["held_out_psnr"].isna().all()
    text = (tmp_path / "out" / "study.md").read_text()
    assert "| 7 | clean | train_surfels | the loss is NaN |" in text
    assert (tmp_path / "out" / "study.png").read_bytes().startswith(b"\x89PNG")
    summary = pd.read_csv(tmp_path / "out" / "summary.csv")
    whole = summary[(summary["property"] == "all")].set_index(["part", "views"])["success"]
    assert whole.to_dict() == {("final", 1): 0.5, ("final", 3): 0.5, ("work", 1): 0.0, ("work", 3): 0.0}
