"""Studies of courses, on fits of a light in a small room."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from PIL import Image

from frozen_store import RESOLUTION, artifact, frozen_artifact, write_targets
from lit_room import room_cameras
from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.light_file import write_lights
from rgspipe.fitting import FitViews
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.studies import study

PLACE = (0.1, -0.25, 0.3)


def _light(place: Sequence[float]) -> PointLight:
    return PointLight(torch.tensor(place, dtype=torch.float64), torch.ones(3, dtype=torch.float64))


def _write_fit(folder: Path, steps: int) -> None:
    """A fit that comes straight to the truth."""
    away = np.linspace(0.3, 0.0, steps)
    curve = pd.DataFrame({"step": range(steps), "loss": away, "x": PLACE[0] - away, "y": PLACE[1], "z": PLACE[2]})
    (folder / "rig_0000").mkdir()
    curve.assign(r=1.0, g=1.0, b=1.0, seconds=away[::-1]).to_csv(folder / "rig_0000" / "convergence.csv", index=False)
    write_lights(folder / "rig_0000" / "lights.json", (_light(PLACE),), {"exposures": [1.0, 1.0]})
    pd.DataFrame([{"target": "rig_0000", "occlusion": "visible"}]).to_csv(folder / "results.csv", index=False)


def test_methods_are_compared_by_the_same_measures(tmp_path: Path) -> None:
    freeze = frozen_artifact(tmp_path / "store")
    views = FitViews.prepare(FrozenScene.load(freeze.folder()), room_cameras(RESOLUTION), sharp=True)
    images = {"rig_0000": views.render(_light(PLACE))}
    truths = {"rig_0000": (_light(PLACE),)}
    targets = artifact(tmp_path / "store", "generate_dataset", lambda folder: write_targets(folder, images, truths))
    fits = [
        artifact(tmp_path / f"fit_{steps}", "fit_light", lambda folder, steps=steps: _write_fit(folder, steps))
        for steps in (4, 7)
    ]
    changes = {
        "views.count": 2,
        "study.kind": "courses",
        "study.methods": ["search_lm", "paper_adam"],
        "effects.auto": False,
    }
    config = with_changes(RgspipeConfig(stage="study"), changes)
    (tmp_path / "out").mkdir()
    inputs = {"freeze": freeze, "generate_dataset": targets}
    study.run(StageContext(config, inputs, {"fit_light": fits}, tmp_path / "out"))
    courses = pd.read_csv(tmp_path / "out" / "courses.csv")
    assert courses["method"].value_counts().to_dict() == {"search_lm": 4, "paper_adam": 7}
    for _, course in courses.groupby("method"):
        errors = course["image_error"].to_numpy()
        assert np.all(np.diff(errors) < 0.0) and errors[0] > 0.01
        assert errors[-1] < 1e-12  # Measured 0: the same render, written as float32.
        assert course["position_error"].iloc[-1] == pytest.approx(0.0, abs=1e-12)
    assert list(courses)[:2] == ["target", "occlusion"] and "kind" not in courses
    summary = pd.read_csv(tmp_path / "out" / "study.csv")
    assert summary["kind"].tolist() == ["courses"] * 2 and summary["scene"].tolist() == ["cornell"] * 2
    assert summary["steps"].tolist() == [3, 6] and (summary["seconds_to_limit"] == summary["seconds"]).all()
    rows = (tmp_path / "out" / "study.md").read_text().splitlines()
    assert len(rows) == 4 and rows[2].startswith("| rig_0000 | visible | search_lm | 3 | 0.30 | 0.30 |")
    with Image.open(tmp_path / "out" / "study.png") as picture:
        assert min(picture.size) > 500
    with Image.open(tmp_path / "out" / "pictures" / "rig_0000.png") as picture:
        assert min(picture.size) > 1000


def test_each_method_is_run_on_few_targets_unless_a_limit_is_given() -> None:
    config = compose_config(["stage=study", "experiment=courses"])
    fits = [need for need in study.STAGE.needs(config) if need.stage == "fit_light"]
    assert [need.changes["fit.method"] for need in fits] == ["search_lm", "paper_adam", "finite_differences"]
    assert {need.changes["fit.limit"] for need in fits} == {1}
    (first, *_) = study.STAGE.needs(with_changes(config, {"fit.limit": 3}))
    assert first.changes["fit.limit"] == 3
