"""stage=track on a light that moves through a small room."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import torch
from PIL import Image

from frozen_store import RESOLUTION, frozen_artifact
from lit_room import room_cameras
from moving_lamp import NAMES, PLACES, followed_lamp
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.views import Target, View
from rgspipe.errors import InputError
from rgspipe.stages.base import StageContext
from rgspipe.stages.lights import track
from rgspipe.stages.lights.fit_light import Fitter


def test_a_track_is_written_and_compared_with_the_truth(tmp_path: Path) -> None:
    _, context = followed_lamp(tmp_path / "store", tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "track.csv")
    assert sorted(table["status"])[:1] == ["searched"] and table["target"].tolist() == NAMES
    assert set(table["status"]) <= {"searched", "tracked", "traced_back"}
    assert table["position_sd"].max() < 1e-2
    assert table["position_error"].max() < 1e-3 and table["intensity_error"].max() < 1e-2
    for name, place in zip(NAMES, PLACES, strict=True):
        (light,) = read_lights(tmp_path / "out" / "frames" / f"{name}.json")
        assert float((light.position - torch.tensor(place, dtype=torch.float64)).norm()) < 1e-3
    with Image.open(tmp_path / "out" / "track.png") as picture:
        assert min(picture.size) > 300
    json.dumps(context.facts, allow_nan=False)
    assert context.facts["searched"] == 1 and context.facts["tracked"] + context.facts["traced_back"] == 2


def test_frames_whose_masks_leave_next_to_nothing_in_common_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    fitter = Fitter.create(
        StageContext(RgspipeConfig(stage="track"), {"freeze": frozen_artifact(tmp_path)}, {}, tmp_path)
    )
    camera, image = room_cameras(RESOLUTION)[0], torch.ones(RESOLUTION, RESOLUTION, 3)
    kept = torch.zeros(2, RESOLUTION, RESOLUTION)
    kept[0, :, : RESOLUTION * 5 // 8] = kept[1, :, RESOLUTION * 3 // 8 :] = 1.0
    frames = [
        Target(name, "unknown", (View(name, camera, image, alpha),))
        for name, alpha in zip(("one", "two"), kept, strict=True)
    ]
    track._frames(fitter, frames, fitter.config)
    assert "the frames together: masks or alpha leave out 75 %" in capsys.readouterr().out


def test_frames_share_the_pixels_that_all_show_and_the_cameras(tmp_path: Path) -> None:
    """Alpha that path tracing leaves noisy at edges differs from frame to frame; that is no other camera."""
    freeze = frozen_artifact(tmp_path / "store")
    config = with_changes(RgspipeConfig(stage="track"), {"views.count": 2})
    fitter = Fitter.create(StageContext(config, {"freeze": freeze}, {}, tmp_path))
    cameras, image = room_cameras(RESOLUTION), torch.ones(RESOLUTION, RESOLUTION, 3)
    first, second = torch.ones(2, RESOLUTION, RESOLUTION)
    first[3, 5], second[7, 2] = 0.4, 0.0
    frames = [
        Target(name, "unknown", tuple(View(name, camera, image, alpha) for camera in cameras))
        for name, alpha in (("one", first), ("two", second))
    ]
    views, images, captures = track._frames(fitter, frames, config)
    assert len(images) == len(captures) == 2
    for mask in views.prepared.masks:
        assert mask[3, 5] == 0.4 and mask[7, 2] == 0.0 and int((mask < 1).sum()) == 2
    moved = replace(frames[1], views=tuple(replace(view, camera=cameras[0]) for view in frames[1].views))
    with pytest.raises(InputError, match="target two: expected the cameras of the first frame, one, found others"):
        track._frames(fitter, [frames[0], moved], config)


def test_the_published_method_does_not_track() -> None:
    config = with_changes(RgspipeConfig(stage="track"), {"fit.method": "paper_adam"})
    with pytest.raises(InputError, match=r"fit\.method"):
        track.STAGE.needs(config)


def test_what_is_no_sequence_is_refused_before_anything_is_made(dataset: Path) -> None:
    """It was told after the scene had been trained."""
    wrong = with_changes(RgspipeConfig(stage="track"), {"track.folder": str(dataset / "targets")})
    with pytest.raises(InputError, match="expected targets/ with the frames, found none"):
        track.STAGE.files(wrong)
    few = with_changes(RgspipeConfig(stage="track"), {"track.folder": str(dataset), "views.count": 3})
    with pytest.raises(InputError, match=r"views\.count"):
        track.STAGE.files(few)


def test_images_elsewhere_are_among_the_files_of_a_track(dataset: Path, change: Callable, tmp_path: Path) -> None:
    """An image outside of `track.folder` that changes must not leave the finished track in use."""
    outside = tmp_path / "elsewhere.exr"
    shutil.move(dataset / "targets/one/view_0.exr", outside)
    change("targets/one/transforms.json", lambda content: content["frames"][0].update(file_path=str(outside)))
    config = with_changes(RgspipeConfig(stage="track"), {"track.folder": str(dataset)})
    assert outside in track.STAGE.files(config)
