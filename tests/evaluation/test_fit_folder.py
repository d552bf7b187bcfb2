"""What a fit of several lights leaves on disk can be read again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from PIL import Image

from lit_room import frozen_room, room_cameras
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.evaluation.fit_folder import read_result, write_result
from rgspipe.evaluation.images import GAP, OUTLINE
from rgspipe.fitting import FitResult, FitViews, Step
from rgspipe.fitting.in_sight.lamp import LampInSight
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


def test_what_a_camera_clipped_is_no_error_of_the_fit(tmp_path: Path) -> None:
    """The render of the true light is brighter there, which the photograph cannot tell from right."""
    views = FitViews.prepare(frozen_room(), room_cameras(8)[:1], mask_edges=False, sharp=False)
    light = PointLight(torch.tensor([0.1, -0.25, 0.2], dtype=torch.float64), torch.ones(3, dtype=torch.float64))
    (image,) = views.render(light)
    limit = float(image.median())
    result = FitResult((light,), (), 0.1, 1, 4, 1, 0.3, (torch.eye(6).double(),), (Step(0.1, (light,), 0.0),))
    clipped, saturated = [image.clamp(max=limit)], [image >= limit]
    write_result(tmp_path / "told", result, views, clipped, saturated=saturated)
    write_result(tmp_path / "untold", result, views, clipped)
    psnrs = [read_result(tmp_path / name)["psnr"] for name in ("told", "untold")]
    assert psnrs[0] == 200.0 and psnrs[1] < 20.0  # 200.0 and 4.7 dB
    final = [(tmp_path / name / "final.exr").read_bytes() for name in ("told", "untold")]
    assert final[0] == final[1]


def test_lamps_in_sight_are_outlined_written_and_not_judged(tmp_path: Path) -> None:
    views = FitViews.prepare(frozen_room(), room_cameras(16)[:2], mask_edges=False, sharp=False)
    light = PointLight(torch.tensor([0.1, -0.25, 0.2], dtype=torch.float64), torch.ones(3, dtype=torch.float64))
    images = views.render(light)
    mask = np.zeros((16, 16), dtype=bool)
    mask[3:6, 4:8] = True
    images[0][torch.from_numpy(mask)] = 100.0
    matrices, steps = (torch.eye(6).double(),), (Step(0.1, (light,), 0.0),)
    plain = FitResult((light,), (), 0.1, 1, 4, 1, 0.3, matrices, steps)
    result = replace(plain, lamps=(LampInSight(0, mask, mask, light=1),))
    for name, one in (("plain", plain), ("lamps", result)):
        write_result(tmp_path / name, one, views, images)

    assert not (tmp_path / "plain/emitters.png").exists()
    written = [np.asarray(Image.open(tmp_path / "lamps" / name)) for name in ("emitters.png", "emitters_1.png")]
    assert np.array_equal(written[0][..., 0] > 0, mask) and not written[1].any()
    psnrs = [read_json(tmp_path / name / "lights.json", "a light file")["psnr"] for name in ("plain", "lamps")]
    assert psnrs[0] < 30.0 < 100.0 < psnrs[1]
    (told,) = read_json(tmp_path / "lamps/lights.json", "a light file")["emitters"]
    assert told == {"view": 0, "column": 6.0, "row": 4.5, "pixels": 12, "given": False, "light": 1}
    before, after = (np.asarray(Image.open(tmp_path / name / "fit.png")) for name in ("plain", "lamps"))
    assert len(after) == len(before) + GAP + 16  # a line that says what is outlined
    changed = (after[: len(before)] != before).any(axis=2)
    ring = np.zeros((16, 16), dtype=bool)
    ring[2:7, 3:9] = True
    assert np.array_equal(changed[:16, :16], ring & ~mask) and (after[2, 3] == OUTLINE).all()
    assert np.array_equal(changed[:16, -16:], ring & ~mask) and not changed[16:].any()
