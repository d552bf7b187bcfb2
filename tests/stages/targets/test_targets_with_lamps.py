"""fit_light on targets in which lamps are in sight: found, given by people, or explained like everything else."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from frozen_store import RESOLUTION, frozen_artifact
from lit_room import room_cameras
from painted_lamps import with_lamp
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.light_file import read_lights
from rgspipe.fitting import FitViews
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.lights import fit_light
from rgspipe.store.artifacts import Artifact

LIGHT = PointLight(
    torch.tensor([0.1, -0.25, 0.2], dtype=torch.float64), torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64)
)


@pytest.fixture(scope="module")
def freeze(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    return frozen_artifact(tmp_path_factory.mktemp("store"))


@pytest.fixture
def target(freeze: Artifact, tmp_path: Path) -> tuple[Path, np.ndarray]:
    """A target of one view in which the lamp is in sight, and where."""
    (camera, *_), folder = room_cameras(RESOLUTION), tmp_path / "lamp"
    views = FitViews.prepare(FrozenScene.load(freeze.folder()), [camera])
    distance = torch.from_numpy(views.sights[0].distance)
    image, share = with_lamp(views.render(LIGHT)[0], camera, distance, LIGHT, 0.05)
    folder.mkdir()
    write_image(folder / "view_0.exr", image.numpy(), np.ones(image.shape[:2], dtype=np.float32))
    write_transforms(folder / "transforms.json", [frame_entry("./view_0", camera)])
    return folder, share.numpy() > 0.0


def fitted(freeze: Artifact, out: Path, target: Path, **changes: object) -> tuple[float, dict, Path]:
    """How far off the light is, lights.json, and the folder of the fit."""
    named = {key.replace("__", "."): value for key, value in changes.items()}
    config = with_changes(RgspipeConfig(stage="fit_light"), {"fit.target": str(target), **named})
    out.mkdir()
    fit_light.run(StageContext(config, {"freeze": freeze}, {}, out))
    folder = out / target.name
    error = float((read_lights(folder / "lights.json")[0].position - LIGHT.position).norm())
    return error, json.loads((folder / "lights.json").read_text()), folder


def test_lamps_are_found_unless_that_is_switched_off(
    freeze: Artifact, target: tuple[Path, np.ndarray], tmp_path: Path
) -> None:
    folder, lamp = target
    error, content, fit = fitted(freeze, tmp_path / "auto", folder)
    mask = np.asarray(Image.open(fit / "emitters.png"))[..., 0] > 0
    assert error < 1e-4 and content["result"] == "converged" and (mask >= lamp).all()
    assert [one["light"] for one in content["emitters"]] == [1]
    assert content["emitters"][0]["pixels"] == int(mask.sum()) and "lamps in sight" in content["reason"]
    error, content, fit = fitted(freeze, tmp_path / "off", folder, fit__emitters="off")
    assert error > 0.01 and content["emitters"] == [] and not (fit / "emitters.png").exists()


def test_what_people_say_is_a_lamp_is_left_out(
    freeze: Artifact, target: tuple[Path, np.ndarray], tmp_path: Path
) -> None:
    """Also where nothing is looked for; and the loss around the light is that of the other pixels."""
    folder, lamp = target
    Image.fromarray(255 * lamp.astype(np.uint8)).save(folder / "mine.png")
    transforms = json.loads((folder / "transforms.json").read_text())
    transforms["frames"][0]["emitter_path"] = "mine.png"
    (folder / "transforms.json").write_text(json.dumps(transforms))
    error, content, fit = fitted(freeze, tmp_path / "given", folder, fit__emitters="off", fit__landscape=True)
    assert error < 1e-4 and [(one["given"], one["pixels"]) for one in content["emitters"]] == [(True, int(lamp.sum()))]
    assert np.array_equal(np.asarray(Image.open(fit / "emitters.png"))[..., 0] > 0, lamp)
    planes = np.load(fit / "landscape.npz")
    least = min(float(planes[name].min()) for name in planes.files if "loss" in name)
    assert least < 0.01  # with the lamp's pixels no light explains more than a few percent of the energy
