"""fit_light on rooms in which there is other light, and relight with what it found."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from frozen_store import RESOLUTION, frozen_artifact, write_display_target, write_targets
from lit_room import VISIBLE, room_cameras
from open_room import TINT, open_surfels
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import read_image
from rgspipe.datasets.light_file import read_ambient, read_lights
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews
from rgspipe.renderer.ambient import ambient_image
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.lights import fit_light
from rgspipe.stages.relight import relight
from rgspipe.store.artifacts import Artifact

LIGHT = PointLight(torch.tensor(VISIBLE, dtype=torch.float64), torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64))


@pytest.fixture(scope="module")
def freeze(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    return frozen_artifact(tmp_path_factory.mktemp("store"), open_surfels)


@pytest.fixture(scope="module")
def images(freeze: Artifact) -> tuple[list[torch.Tensor], list[torch.Tensor]]:
    """Two views of LIGHT with light of TINT from all around, and the same without LIGHT."""
    frozen = FrozenScene.load(freeze.folder())
    lit = FitViews.prepare(frozen, room_cameras(RESOLUTION), sharp=True).render(LIGHT)
    base = [4.0 * TINT * ambient_image(frozen, camera) for camera in room_cameras(RESOLUTION)]
    return [one + other for one, other in zip(lit, base, strict=True)], base


def _config(stage: str, **changes: object) -> RgspipeConfig:
    named = {key.replace("__", "."): value for key, value in changes.items()}
    return with_changes(RgspipeConfig(stage=stage), {"views.count": 2} | named)


def _fitted(freeze: Artifact, folder: Path, target: Path, **changes: object) -> tuple[float, dict]:
    """How far off the light is, and the light file."""
    folder.mkdir()
    fit_light.run(
        StageContext(_config("fit_light", fit__target=str(target), **changes), {"freeze": freeze}, {}, folder)
    )
    file = folder / target.name / "lights.json"
    return float((read_lights(file)[0].position - LIGHT.position).norm()), json.loads(file.read_text())


def test_images_with_the_lamps_off_are_taken_away(freeze: Artifact, images: tuple, tmp_path: Path) -> None:
    both, base = images
    write_targets(tmp_path, {"lit": both, "off": base}, {"lit": (LIGHT,), "off": ()})
    target, off = tmp_path / "targets/lit", tmp_path / "targets/off"
    raw, _ = _fitted(freeze, tmp_path / "raw", target)
    error, content = _fitted(freeze, tmp_path / "out", target, fit__base=str(off))
    assert error < 1e-6 and raw > 0.1  # measured 2e-8 and 0.18
    assert content["result"] == "converged" and content["psnr"] > 60.0
    free, scaled = _fitted(freeze, tmp_path / "free", target, fit__base=str(off), fit__base_scale="free")
    assert free < 1e-6 and scaled["base_scale"]["factor"] == pytest.approx([1.0] * 3, rel=1e-3)
    # What was there stands beside the target in the picture, and in the fit's own images.
    widths = [Image.open(tmp_path / name / "lit" / "fit.png").width for name in ("raw", "out")]
    assert widths[1] > widths[0]
    final = read_image(tmp_path / "out" / "lit" / "final.exr")[0]
    np.testing.assert_allclose(final, both[0].numpy(), atol=2e-3 * float(both[0].max()))


def test_frames_name_them_and_eight_bits_are_clipped(freeze: Artifact, images: tuple, tmp_path: Path) -> None:
    both, base = images
    white = float(torch.cat([image.reshape(-1) for image in both]).quantile(0.95))
    write_display_target(tmp_path / "target", [image / white for image in both])
    write_display_target(tmp_path / "off", [image / white for image in base])
    path = tmp_path / "target" / "transforms.json"
    content = json.loads(path.read_text())
    for index, frame in enumerate(content["frames"]):
        frame["base_path"] = f"../off/view_{index}.png"
    path.write_text(json.dumps(content))
    error, found = _fitted(freeze, tmp_path / "out", tmp_path / "target")
    assert error < 2e-3 and found["result"] == "converged"  # measured 0.0004


def test_what_does_not_belong_together_is_refused(freeze: Artifact, images: tuple, tmp_path: Path) -> None:
    both, base = images
    write_targets(tmp_path, {"lit": both}, {"lit": (LIGHT,)})
    write_display_target(tmp_path / "off", base)
    target = tmp_path / "targets/lit"
    with pytest.raises(InputError, match="8 bits"):
        _fitted(freeze, tmp_path / "out", target, fit__base=str(tmp_path / "off"))
    with pytest.raises(InputError, match=r"fit\.target"):
        fit_light.STAGE.files(_config("fit_light", fit__base=str(tmp_path / "off")))
    write_targets(tmp_path / "more", {"off": base}, {"off": ()})
    off = str(tmp_path / "more/targets/off")
    for key, changes in {
        "fit.base": {"fit__method": "paper_adam"},
        "target_capture": {"target_capture__noise": 0.01},
        "base": {"fit__base_scale": "free", "fit__exposure": "free"},
    }.items():
        with pytest.raises(InputError, match=key):
            _fitted(freeze, tmp_path / f"refused_{key}", target, fit__base=off, **changes)
    with pytest.raises(InputError, match=r"light\.ambient"):
        _fitted(freeze, tmp_path / "paper", target, fit__method="paper_adam", light__ambient=True)


def test_light_from_all_around_is_found_and_relit(freeze: Artifact, images: tuple, tmp_path: Path) -> None:
    both, _ = images
    write_targets(tmp_path, {"lit": both}, {"lit": (LIGHT,)})
    target = tmp_path / "targets/lit"
    error, content = _fitted(freeze, tmp_path / "out", target, light__ambient=True)
    assert error < 1e-6 and content["psnr"] > 100.0  # measured 2e-8 and 156 dB
    assert content["ambient"]["radiance"] == pytest.approx((4.0 * TINT).tolist(), rel=1e-3)
    assert "comes from all around" in content["reason"]
    lights = tmp_path / "out" / "lit" / "lights.json"
    torch.testing.assert_close(read_ambient(lights), 4.0 * TINT.double(), rtol=1e-3, atol=0.0)
    config = _config("relight", relight__lights=str(lights), relight__views="targets", fit__target=str(target))
    (tmp_path / "relit").mkdir()
    relight.run(StageContext(config, {"freeze": freeze}, {}, tmp_path / "relit"))
    image = read_image(tmp_path / "relit" / "images" / "lights" / "view_0.exr")[0]
    np.testing.assert_allclose(image, both[0].numpy(), atol=2e-3 * float(both[0].max()))
    again = tmp_path / "relit" / "lights" / "lights.json"
    torch.testing.assert_close(read_ambient(again), read_ambient(lights))


def test_ambient_light_of_a_file_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"version": 1, "lights": [], "ambient": {"radiance": [1.0, -1.0, 0.0]}}))
    with pytest.raises(InputError, match=r"ambient\.radiance"):
        read_ambient(path)
    path.write_text(json.dumps({"version": 1, "lights": []}))
    assert read_ambient(path) is None and read_lights(path) == ()
