"""The stages evaluate and report, on small but genuine files."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch

from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.grade_file import GRADE, save_grade
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.landscape_file import PLANES, Landscape, PlaneLoss, landscape_bytes
from rgspipe.datasets.light_file import write_lights
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.errors import InputError
from rgspipe.evaluation import images
from rgspipe.scene import NO_CLIP, Camera, Coverage, PointLight, Surfels, look_at
from rgspipe.scene.grade import SceneGrade
from rgspipe.stages.base import StageContext
from rgspipe.stages.evaluation import evaluate, judge
from rgspipe.stages.report import report
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key

TARGETS = (("visible_000", "visible"), ("visible_001", "visible"), ("occluded_000", "occluded"))


def _artifact(root: Path, stage: str, make: Callable[[Path], None], fingerprint: str = "aa") -> Artifact:
    def build(folder: Path) -> dict:
        make(folder)
        return {}

    return ArtifactStore(root).build(Key("room", stage, fingerprint), {"config": {}, "inputs": {}, "code": {}}, build)[
        0
    ]


def _light(position: list[float]) -> PointLight:
    return PointLight(torch.tensor(position, dtype=torch.float64), torch.ones(3, dtype=torch.float64))


def _write_dataset(folder: Path, truth: bool = True, bounds: bool = True) -> None:
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.5, -1.5, 0.5]), torch.full((3,), 0.5)), 0.7, 8, 8)
    for name, _ in TARGETS:
        target = folder / "targets" / name
        target.mkdir(parents=True)
        write_image(target / "view_0.exr", np.ones((8, 8, 3), dtype=np.float32))
        write_transforms(target / "transforms.json", [frame_entry("./view_0", camera)])
        if truth:
            write_lights(folder / "truth" / f"{name}.json", (_light([0.5, 0.5, 1.0]),))
    info = {"version": 1, "depth_convention": "planar_z"} | ({"bounds": [[0, 0, 0], [1, 2, 1]]} if bounds else {})
    (folder / "dataset_info.json").write_text(json.dumps(info))


def _landscape(answer: np.ndarray) -> bytes:
    offsets = np.linspace(-0.1, 0.1, 3)
    planes = {
        name: PlaneLoss(
            *(answer["xyz".index(letter)] + offsets for letter in name), 0.1 + offsets[:, None] ** 2 * np.ones(3)
        )
        for name in PLANES
    }
    return landscape_bytes(Landscape(planes, np.stack([answer + 0.1, answer])))


def _write_fit(folder: Path, views: int) -> None:
    rows = []
    for index, (name, occlusion) in enumerate(TARGETS):
        (folder / name).mkdir()
        found = [0.5, 0.5, 1.0 + 0.01 * index]
        spread = {"covariance": np.diag([1e-4] * 3 + [1.0] * 3).tolist()}
        extra = {"loss": 0.1, "reason": "small step", "lights": [spread]}
        write_lights(folder / name / "lights.json", (_light(found),), extra)
        (folder / name / "landscape.npz").write_bytes(_landscape(np.array(found)))
        steps = pd.DataFrame({"step": [0, 1], "loss": [1.0, 0.1], "x": 0.5, "y": 0.5, "z": [0.0, found[2]]})
        steps.assign(r=1.0, g=1.0, b=1.0, seconds=[0.1, 0.2]).to_csv(folder / name / "convergence.csv", index=False)
        image = np.random.default_rng(index).uniform(size=(8, 8, 3))
        images.save_png(folder / name / "fit.png", images.comparison_strip(image, image))
        row = {"target": name, "occlusion": occlusion, "method": "search_lm", "views": views}
        row |= dict(zip("xyzrgb", [*found, 1.0, 1.0, 1.0], strict=True))
        rows.append(row | {"loss": 0.1, "seconds": 1.0, "psnr": 40.0, "result": "converged", "reason": "small step"})
    pd.DataFrame(rows).to_csv(folder / "results.csv", index=False)


def _write_freeze(folder: Path) -> None:
    count = 50
    rotations = torch.zeros(count, 4)
    rotations[:, 0] = 1.0
    surfels = Surfels(
        centers=torch.rand(count, 3, generator=torch.Generator().manual_seed(0)),
        rotations=rotations,
        scales=torch.full((count, 2), 0.05),
        opacities=torch.ones(count),
        albedo=torch.full((count, 3), 0.5),
        clip_offsets=torch.full((count, 2), NO_CLIP),
        clip_angles=torch.zeros(count, 2),
        coverage=Coverage(0.5, 0.9, 0.05, 0.01),
    )
    save_surfels(folder / "surfels.safetensors", surfels)


def _write_training(folder: Path) -> None:
    (folder / "metrics.json").write_text(json.dumps({"test_psnr_mean": 36.0, "per_view": []}))
    (folder / "training.csv").write_text("round,kind,loss,psnr,seconds\n0,albedo,1.0,20,1\n1,albedo,0.5,30,2\n")


def _context(folder: Path, config: RgspipeConfig, **inputs: list[Artifact]) -> StageContext:
    folder.mkdir()
    return StageContext(config, {name: found[0] for name, found in inputs.items()}, inputs, folder)


def _evaluate(tmp_path: Path, config: RgspipeConfig, name: str = "out", **dataset: bool) -> Path:
    made = _artifact(tmp_path / name, "generate_dataset", lambda folder: _write_dataset(folder, **dataset))
    fit = _artifact(tmp_path / name, "fit_light", lambda folder: _write_fit(folder, config.views.count))
    freeze = _artifact(tmp_path / name, "freeze", _write_freeze)
    folder = tmp_path / f"{name}_result"
    evaluate.STAGE.run(_context(folder, config, fit_light=[fit], generate_dataset=[made], freeze=[freeze]))
    return folder


@pytest.fixture
def config(tmp_path: Path) -> RgspipeConfig:
    # A report shows studies and targets that it finds among the outputs.
    return with_changes(RgspipeConfig(), {"stage": "evaluate", "outputs": str(tmp_path / "outputs")})


def test_evaluate_writes_errors_summary_course_and_pictures(tmp_path, config):
    folder = _evaluate(tmp_path, config)
    targets = pd.read_csv(folder / "metrics.csv")
    assert targets["position_error"].tolist() == pytest.approx([0.0, 0.005, 0.01])  # the longest side is 2
    summary = pd.read_csv(folder / "summary.csv").set_index("occlusion")
    assert summary.loc["visible", "median_position_error"] == pytest.approx(0.0025)
    assert summary.loc["all", "count"] == 3
    # The regions have a radius of 2.8 standard deviations of 0.01; the estimates are off by 0, 0.01 and 0.02.
    assert targets["inside_95"].tolist() == [True, True, True] and summary.loc["all", "inside_95"] == 1.0
    assert targets["position_sd"].tolist() == pytest.approx([0.5 * math.sqrt(3e-4)] * 3)
    assert (folder / "pictures" / "visible_worst_landscape.png").read_bytes().startswith(b"\x89PNG")
    curves = pd.read_csv(folder / "convergence.csv")
    assert curves["position_error"].iloc[0] == pytest.approx(0.5) and len(curves) == 6
    found = json.loads((folder / "metrics.json").read_text())
    assert found["scene_size"] == 2.0 and found["notes"] == []
    assert found["sought"] == {"number": False, "types": False} and targets["types_right"].all()
    assert found["cameras"][0]["origin"] == pytest.approx([0.5, -1.5, 0.5])
    assert found["cameras"][0]["direction"] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert found["cameras"][0]["angle"] == pytest.approx(0.7)
    assert {entry["file"] for entry in found["pictures"]} == {
        path.relative_to(folder).as_posix() for path in folder.rglob("*.png")
    }
    assert [entry["kind"] for entry in found["pictures"]] == ["median", "worst", "median", *["landscape"] * 3]


def test_generated_targets_are_judged_by_their_own_truth(tmp_path, config):
    generated = with_changes(config, {"fit.targets": "generated"})
    assert [need.stage for need in evaluate.STAGE.needs(generated)] == ["fit_light", "generate_targets", "freeze"]
    made = _artifact(tmp_path, "generate_targets", _write_dataset)
    fit = _artifact(tmp_path, "fit_light", lambda folder: _write_fit(folder, 1))
    evaluate.STAGE.run(_context(tmp_path / "result", generated, fit_light=[fit], generate_targets=[made]))
    assert pd.read_csv(tmp_path / "result/metrics.csv")["position_error"].max() == pytest.approx(0.01)


def test_missing_truth_is_stated_and_no_error(tmp_path, config):
    folder = _evaluate(tmp_path, config, truth=False)
    assert pd.read_csv(folder / "metrics.csv")["position_error"].isna().all()
    found = json.loads((folder / "metrics.json").read_text(), parse_constant=pytest.fail)
    assert "No true lights are known for 3 of 3 targets" in found["notes"][0]
    assert found["summary"][0]["median_position_error"] is None


def test_missing_bounds_are_replaced_by_those_of_the_surfels_and_said(tmp_path, config):
    found = json.loads((_evaluate(tmp_path, config, bounds=False) / "metrics.json").read_text())
    assert 0.9 < found["scene_size"] < 1.0 and "surfels' centres" in found["notes"][0]


def test_truth_of_a_single_target_is_the_file_that_is_given(tmp_path, config):
    write_lights(tmp_path / "truth.json", (_light([0.5, 0.5, 0.0]),))
    _write_dataset(tmp_path / "foreign")
    target = tmp_path / "foreign" / "targets" / "visible_000"
    changes = {"fit.target": str(target), "fit.truth": str(tmp_path / "truth.json")}
    folder = _evaluate(tmp_path, with_changes(config, changes))
    assert pd.read_csv(folder / "metrics.csv")["position_error"].iloc[0] == pytest.approx(0.5)
    assert evaluate.STAGE.files(with_changes(config, changes)) == [tmp_path / "truth.json"]


def test_impossible_bounds_name_the_file(tmp_path, config):
    def write(folder: Path) -> None:
        _write_dataset(folder)
        (folder / "dataset_info.json").write_text('{"version": 1, "bounds": [[1, 1, 1], [0, 0, 0]]}')

    made = _artifact(tmp_path, "generate_dataset", write)
    fit = _artifact(tmp_path, "fit_light", lambda folder: _write_fit(folder, 1))
    with pytest.raises(InputError, match=r"dataset_info\.json: bounds"):
        evaluate.STAGE.run(_context(tmp_path / "result", config, fit_light=[fit], generate_dataset=[made]))


def test_report_gathers_evaluations_training_and_provenance(tmp_path, config):
    evaluations = []
    for views in (1, 3):
        one = _evaluate(tmp_path, with_changes(config, {"views.count": views}), name=f"views_{views}")
        copied = _artifact(tmp_path / "all", "evaluate", lambda folder, one=one: _copy(one, folder), f"e{views}")
        evaluations.append(copied)
    freeze = _artifact(tmp_path / "all", "freeze", _write_freeze, "f0")
    trained = _artifact(tmp_path / "all", "train_surfels", _write_training, "t0")
    context = _context(tmp_path / "report", config, evaluate=evaluations, freeze=[freeze], train_surfels=[trained])
    report.STAGE.run(context)
    html = (tmp_path / "report" / "report.html").read_text()
    for text in ("search_lm, 1 view", "search_lm, 3 views", "36.00 dB", "evaluate (search_lm, 3 views)", "e3", "t0"):
        assert text in html
    assert html.count('alt="true and recovered light positions') == 2
    # Only pictures of held-out views and of the scene are missing: neither its judgement nor its dataset came along.
    assert html.count('<p class="missing">') == 2
    assert "no picture that compares" in html and "no pictures of the scene" in html
    summary = json.loads((tmp_path / "report" / "summary.json").read_text(), parse_constant=pytest.fail)
    assert summary["highlights"]["psnr"] == 36.0 and summary["highlights"]["targets"] == 3
    assert [row["occlusion"] for row in summary["lights"]] == ["visible", "occluded"]
    assert context.facts["bytes"] == len(html.encode())


def test_report_without_anything_still_says_so(tmp_path, config):
    report.STAGE.run(_context(tmp_path / "report", config))
    assert "No lights were fitted" in (tmp_path / "report" / "report.html").read_text()


def test_a_report_does_without_views_that_are_left_out_and_has_the_grade_above_the_fits(tmp_path, config, dataset):
    (dataset / "transforms_test.json").unlink()
    external = with_changes(config, {"scene.kind": "external"})
    inputs = {"generate_dataset": SimpleNamespace(folder=lambda: dataset)}
    judged = _artifact(tmp_path, "judge", lambda folder: judge.run(StageContext(external, inputs, {}, folder)))
    grade = SceneGrade(None, 12, 0.2, 0.0, 0.0, 0.35, 0.0, (0.5, 0.0, 0.25))

    def frozen(folder: Path) -> None:
        _write_freeze(folder)
        save_grade(folder / GRADE, grade)

    trained = _artifact(tmp_path, "train_surfels", lambda folder: (folder / "metrics.json").write_text("{}"))
    parts = {"judge": [judged, judged], "freeze": [_artifact(tmp_path, "freeze", frozen)], "train_surfels": [trained]}
    report.STAGE.run(_context(tmp_path / "report", external, **parts))
    html = (tmp_path / "report" / "report.html").read_text()
    assert "The scene is poor" in html and "first of all around (0.50, 0.00, 0.25)" in html
    assert html.index("The scene is poor") < html.index('id="trained"') < html.index('id="lights"')
    assert "judge</td>" in html and "judge (true surfels)</td>" in html
    assert "no picture that compares" in html and "Where the squared error sits" not in html


def test_report_needs_every_method_that_is_asked_for_with_every_number_of_views(config):
    def made(wanted):
        changes = [need.changes for need in report.STAGE.needs(wanted) if need.stage == "evaluate"]
        return {(one["fit.method"], one["views.count"], one.get("fit.limit")) for one in changes}

    ours = {("search_lm", 1, None), ("search_lm", 3, None)}
    assert made(config) == ours
    both = with_changes(config, {"report.methods": ("search_lm", "paper_adam")})
    assert made(both) == ours | {("paper_adam", 1, 1), ("paper_adam", 3, 1)}
    assert made(with_changes(both, {"report.paper_adam_views": (1,)})) == ours | {("paper_adam", 1, 1)}
    assert "fit" in report.STAGE.keys(config) and "outputs" not in report.STAGE.keys(config)


def test_a_report_asks_for_no_more_views_than_targets_have(config, tmp_path):
    """Where it did, the report of a target with two images ended in an error about a key that nobody had set."""
    frame = {"file_path": "view.exr", "transform_matrix": np.eye(4).tolist(), "camera_angle_x": 0.7}
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": [frame, frame]}))
    own = with_changes(config, {"fit.target": str(tmp_path)})
    few = with_changes(config, {"dataset.target_views": 2})
    for one in (own, few):
        assert {need.changes["views.count"] for need in report.STAGE.needs(one) if need.stage == "evaluate"} == {1, 2}


def _copy(source: Path, folder: Path) -> None:
    for path in source.rglob("*"):
        target = folder / path.relative_to(source)
        target.mkdir(exist_ok=True) if path.is_dir() else target.write_bytes(path.read_bytes())
