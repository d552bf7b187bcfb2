"""What a fit of several lights leaves on disk can be read again."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
import torch

from lit_room import frozen_room, room_cameras
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.evaluation.fit_folder import read_result, write_result
from rgspipe.fitting import FitResult, FitViews, Step
from rgspipe.scene import PointLight, SpotLight


def test_a_rig_with_a_spot_is_written_whole(tmp_path: Path) -> None:
    views = FitViews.prepare(frozen_room(), room_cameras(8)[:1], mask_edges=False, sharp=False)
    place, ones = torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64), torch.ones(3, dtype=torch.float64)
    axis = torch.tensor([0.0, 0.6, -0.8], dtype=torch.float64)
    rig = (PointLight(place, ones), SpotLight(-place, 2.0 * ones, axis, "gaussian", 0.4, 0.1))
    steps = (Step(0.5, rig, 0.0), Step(0.1, rig, 0.25))
    matrices = (torch.eye(6).double(), torch.eye(9).double())
    result = FitResult(rig, (), 0.1, 1, 4, 3, 0.3, matrices, steps, {1: 0.9, 2: 0.2, 3: 0.19})
    write_result(tmp_path / "target", result, views, views.render(rig))

    content = read_json(tmp_path / "target" / "lights.json", "a light file")
    assert content["costs"] == {"1": 0.9, "2": 0.2, "3": 0.19} and content["lights_tried"] == 3
    assert [len(light["covariance"]) for light in content["lights"]] == [6, 9]
    point, spot = read_lights(tmp_path / "target" / "lights.json")
    assert isinstance(point, PointLight) and isinstance(spot, SpotLight)
    assert spot.direction.tolist() == pytest.approx(axis.tolist()) and spot.cone_angle == 0.4
    assert read_result(tmp_path / "target")["x"] == pytest.approx(0.1)
    curve = pd.read_csv(tmp_path / "target" / "convergence.csv")
    assert curve["x_1"].tolist() == pytest.approx([-0.1, -0.1]) and curve["az_1"].tolist() == pytest.approx(
        [-0.8, -0.8]
    )
    assert "ax" not in curve.columns and content["psnr"] > 100.0
