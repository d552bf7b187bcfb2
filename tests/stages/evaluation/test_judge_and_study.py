"""Surfels from the truth, and the study that gathers what was judged and evaluated."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.errors import InputError
from rgspipe.evaluation.held_out import QUALITY
from rgspipe.stages.base import Need, StageContext
from rgspipe.stages.evaluation import judge
from rgspipe.stages.scene import true_surfels
from rgspipe.stages.sources import has_truth, surfel_stage
from rgspipe.stages.studies import study
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.studies.captures import TRUTH


def _config(**changes: object) -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {key.replace("__", "."): value for key, value in changes.items()})


def _artifact(root: Path, stage: str, fingerprint: str, make: Callable[[Path], None]) -> Artifact:
    def build(folder: Path) -> dict:
        make(folder)
        return {}

    recipe = {"config": {}, "inputs": {}, "code": {}}
    return ArtifactStore(root).build(Key("room", stage, fingerprint), recipe, build)[0]


def test_frozen_surfels_come_from_where_the_configuration_says() -> None:
    assert surfel_stage(_config()) == "train_surfels"
    assert surfel_stage(_config(freeze__surfels="truth")) == "true_surfels"
    assert surfel_stage(_config(scene__kind="ply")) == "import_ply"
    with pytest.raises(InputError, match=r"freeze.surfels.*scene=ply"):
        surfel_stage(_config(scene__kind="ply", freeze__surfels="truth"))
    assert has_truth(_config()) and not has_truth(_config(scene__kind="external"))


def test_true_surfels_of_a_cornell_box_are_its_rectangles(tmp_path: Path) -> None:
    config = _config(init__surfels=500)
    assert true_surfels.STAGE.needs(config) == ()
    true_surfels.run(StageContext(config, {}, {}, tmp_path))
    surfels = load_surfels(tmp_path / "surfels.safetensors")
    assert 400 < len(surfels) < 620
    colours = {tuple(round(value, 3) for value in row) for row in surfels.albedo.tolist()}
    cornell = config.scene.cornell
    assert colours == {tuple(c) for c in (cornell.wall_color, cornell.left_color, cornell.right_color)}
    assert surfels.centers.abs().amax() <= 0.5 + 1e-6


def test_true_surfels_of_glossy_boxes_have_their_lobe_and_the_walls_have_none(tmp_path: Path) -> None:
    config = _config(init__surfels=500, scene__cornell__gloss=0.2, scene__cornell__box_color=[0.5, 0.5, 0.5])
    true_surfels.run(StageContext(config, {}, {}, tmp_path))
    surfels = load_surfels(tmp_path / "surfels.safetensors")
    on_box = (surfels.albedo - 0.5).abs().amax(dim=1) < 1e-6
    assert 0 < int(on_box.sum()) < len(surfels)
    assert surfels.gloss.glossy.tolist() == on_box.nonzero()[:, 0].tolist()
    assert surfels.gloss.reflectance[on_box].unique().tolist() == pytest.approx([0.2])
    assert surfels.gloss.exponents[on_box].unique().tolist() == [config.scene.cornell.shininess]


def test_true_surfels_of_the_corridor_are_its_rectangles(tmp_path: Path) -> None:
    config = _config(scene__kind="corner", init__surfels=900)
    assert true_surfels.STAGE.needs(config) == ()
    true_surfels.run(StageContext(config, {}, {}, tmp_path))
    surfels = load_surfels(tmp_path / "surfels.safetensors")
    assert 700 < len(surfels) < 1100 and surfels.centers.abs().amax() <= 0.5 + 1e-6


def test_true_surfels_of_other_scenes_come_from_the_passes() -> None:
    assert true_surfels.STAGE.needs(_config(scene__kind="room")) == (Need("generate_dataset"),)


def test_a_scene_is_judged_beside_its_truth_where_that_is_known() -> None:
    needs = judge.STAGE.needs(_config())
    assert [need.changes for need in needs if need.stage == "freeze"] == [{}, {"freeze.surfels": "truth"}]
    needs = judge.STAGE.needs(_config(scene__kind="external"))
    assert [need.changes for need in needs if need.stage == "freeze"] == [{}]


def test_a_dataset_that_leaves_out_no_view_is_judged_by_nothing_and_a_study_of_captures_refuses_it(
    tmp_path: Path, dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (dataset / "transforms_test.json").unlink()
    inputs = {"generate_dataset": SimpleNamespace(folder=lambda: dataset)}
    external = {"scene__kind": "external", "scene__path": str(dataset), "scene__name": "own"}

    def empty(folder: Path) -> None:
        judge.run(StageContext(_config(**external), inputs, {}, folder))

    made = _artifact(tmp_path, "judge", "aa", empty)
    assert "judge: no view was left out of training (transforms_test.json)" in capsys.readouterr().out
    assert list(pd.read_csv(made.file("quality.csv"))) == ["surfels", "light", *QUALITY]
    assert all(pd.read_csv(made.file(f"{name}.csv")).empty for name in ("quality", "split", "views"))
    lists = {"judge": [made], "evaluate": [made]}
    with pytest.raises(InputError, match=r"left out of training.*no transforms_test\.json"):
        study.run(StageContext(_config(study__kind="captures", **external), {}, lists, tmp_path))


def test_surfels_without_images_cannot_be_judged(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="held-out views"):
        judge.run(StageContext(_config(scene__kind="ply", scene__path="x.ply"), {}, {}, tmp_path))


def test_a_study_needs_every_case_of_every_scene_and_the_truth() -> None:
    config = _config(
        study__cases=["clean", "capture.depth_noise=0.01"], study__scenes=["cornell", "room"], study__limit=2
    )
    needs = study.STAGE.needs(config)
    judged = [need.changes for need in needs if need.stage == "judge"]
    assert len(judged) == 6 and len(needs) == 12
    assert judged[1] == {"scene.kind": "cornell", "scene.name": None, "capture.depth_noise": 0.01}
    assert judged[5] == {"scene.kind": "room", "scene.name": None, "freeze.surfels": "truth"}
    evaluated = next(need.changes for need in needs if need.stage == "evaluate")
    assert evaluated["fit.limit"] == 2 and evaluated["views.count"] == 1
    for need in needs:
        with_changes(config, need.changes)


@pytest.mark.parametrize("case", ["capture.depth_nose=0.1", "depth_noise=0.1", "capture.depth_noise"])
def test_a_case_that_is_none_is_refused(case: str) -> None:
    with pytest.raises(InputError, match=r"study\.cases"):
        study.STAGE.needs(_config(study__cases=[case]))


def test_a_study_is_one_table_a_figure_and_text(tmp_path: Path) -> None:
    errors = {"clean": 0.01, "views=25": 0.03, TRUTH: 0.005}

    def write_quality(folder: Path, error: float) -> None:
        row = {"surfels": "trained"} | dict.fromkeys(QUALITY, 0.5) | {"psnr": 40.0 - 100.0 * error}
        pd.DataFrame([row | {"light": light} for light in ("pixels", "centres")]).to_csv(folder / "quality.csv")

    def write_lights(folder: Path, error: float) -> None:
        table = pd.DataFrame({"occlusion": ["visible", "all"], "median_position_error": error})
        table.assign(median_intensity_error=0.02, success_rate=0.5).to_csv(folder / "summary.csv", index=False)

    lists: dict[str, list[Artifact]] = {"judge": [], "evaluate": []}
    for index, error in enumerate(errors.values()):
        for stage, write in (("judge", write_quality), ("evaluate", write_lights)):
            made = _artifact(tmp_path, stage, f"{index:02x}", lambda folder, w=write, e=error: w(folder, e))
            lists[stage].append(made)
    folder = tmp_path / "study"
    folder.mkdir()
    config = _config(study__cases=["clean", "capture.views=25"])
    context = StageContext(config, {name: found[0] for name, found in lists.items()}, lists, folder)
    study.run(context)
    table = pd.read_csv(folder / "study.csv")
    assert table["case"].tolist() == list(errors) and set(table["scene"]) == {"cornell"}
    assert table["factor"].tolist() == pytest.approx([2.0, 6.0, 1.0])
    assert table["psnr"].tolist() == pytest.approx([39.0, 37.0, 39.5])
    text = (folder / "study.md").read_text()
    assert "| cornell | views=25 | 37.0 |" in text and text.count("\n") == 5
    assert (folder / "study.png").read_bytes().startswith(b"\x89PNG")
    json.dumps(context.facts)
