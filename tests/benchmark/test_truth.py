"""Path-traced truth in closed form, its noise, and what is wrong with a folder that holds none."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import math
from pathlib import Path

import pytest
import torch
from torch import Tensor

from rgspipe.benchmark.rooms import Room
from rgspipe.benchmark.truth import load_truth, render_truth
from rgspipe.datasets.exr import read_channels, write_channels
from rgspipe.errors import InputError
from rgspipe.evaluation.metrics import psnr
from rgspipe.scene.rectangles import inside_of_box
from rgspipe.store.whole_files import RECORD
from tabletop import TABLETOP, lit_tabletop

pytestmark = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")


@pytest.fixture(scope="module")
def tabletop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """TABLETOP, rendered in one go."""
    folder = tmp_path_factory.mktemp("tabletop")
    render_truth(TABLETOP, folder, resolution=16, samples=64)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("camera", [0, 1])
@pytest.mark.parametrize("light", [0, 1])
def test_a_lit_rectangle_is_the_closed_form_seen_as_our_cameras_see_it(tabletop: Path, camera: int, light: int) -> None:
    truth = load_truth(tabletop)
    expected = lit_tabletop(camera, light, 16)
    for kind in ("direct", "global"):
        image = truth.image(camera, light, kind)
        # Direct images have 16 samples a pixel here: measured 42.4 dB at worst, 56 dB for global ones with 64.
        assert psnr(image, expected) > 38.0
        # Measured 22.1 dB at most, with the image the wrong way round.
        assert psnr(image.flip(0), expected) < 28.0 and psnr(image.flip(1), expected) < 28.0
        # Measured 2.4e-3 (direct), 4e-4 (global).
        assert float(image.double().mean() / expected.mean()) == pytest.approx(1.0, abs=6e-3)


@pytest.mark.slow
def test_a_closed_room_keeps_every_bounce(tmp_path: Path) -> None:
    # Six views of 90° from the centre of a cube see equal areas in equal pixels. The walls absorb what the light
    # emits, (1 − ρ)·π·L·A/ρ = 4π·I, so the mean radiance is 4·ρ·I/((1 − ρ)·A), wherever the light stands.
    axes = torch.cat([torch.eye(3), -torch.eye(3)])
    views = torch.stack([torch.zeros(6, 3), axes], dim=1)
    lights = torch.tensor([[0.2, -0.1, 0.15]])
    room = Room("cube", inside_of_box([0, 0, 0], [1, 1, 1], [0.3, 0.5, 0.8]), views, lights, math.pi / 2)
    render_truth(room, tmp_path, resolution=8, samples=256)
    truth = load_truth(tmp_path)
    albedo = torch.tensor([0.3, 0.5, 0.8], dtype=torch.float64)
    found = truth.images["global"].double().mean(dim=(0, 1, 2, 3))
    # Measured 6e-4, 1.1e-3 and 2.9e-3: noise, largest where there are most bounces.
    torch.testing.assert_close(found, 4 * albedo / (1 - albedo) / 6, rtol=1e-2, atol=0.0)
    direct = truth.images["direct"].double().mean(dim=(0, 1, 2, 3))
    torch.testing.assert_close(direct, 4 * albedo / 6, rtol=5e-4, atol=0.0)  # measured 1e-4


def _digests(folder: Path) -> dict[str, str]:
    # The record of what is whole gets a line more for each image that is rendered again.
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != RECORD)
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


@pytest.mark.slow
def test_what_is_there_is_kept_and_what_is_damaged_is_rendered_again(tabletop: Path) -> None:
    before = _digests(tabletop)
    kept = tabletop / "global/camera_0_light_0.exr"
    stamp = kept.stat().st_mtime_ns
    cut = tabletop / "direct/camera_1_light_0.exr"
    cut.write_bytes(cut.read_bytes()[:-30])
    (tabletop / "global/camera_1_light_1.exr").unlink()
    render_truth(TABLETOP, tabletop, resolution=16, samples=64)
    assert _digests(tabletop) == before
    assert kept.stat().st_mtime_ns == stamp


@pytest.mark.slow
def test_a_folder_of_other_truth_is_refused(tabletop: Path) -> None:
    with pytest.raises(InputError, match=r"job\.json.*differs in direct_samples, samples"):
        render_truth(TABLETOP, tabletop, resolution=16, samples=128)


def _synthetic(folder: Path, spread: float) -> Tensor:
    """Truth of one white noise image, its halves `spread` apart; returns the exact image."""
    generator = torch.Generator().manual_seed(1)
    exact = torch.rand(64, 64, 3, generator=generator, dtype=torch.float64)
    halves = exact + spread * torch.randn(2, 64, 64, 3, generator=generator, dtype=torch.float64)
    parts = {"": 0.5 * (halves[0] + halves[1]), "noise.": 0.5 * (halves[0] - halves[1])}
    channels = {f"{p}{c}": x[..., i].numpy() for p, x in parts.items() for i, c in enumerate("RGB")}
    for kind in ("direct", "global"):
        write_channels(folder / kind / "camera_0_light_0.exr", channels)
    facts = {"room": "noise", "resolution": 64, "samples": 2, "cameras": [0], "lights": [0]}
    (folder / "truth.json").write_text(json.dumps(facts))
    return exact


def test_the_truth_s_own_noise_is_not_held_against_an_image(tmp_path: Path) -> None:
    exact = _synthetic(tmp_path, 0.1)
    truth = load_truth(tmp_path)
    image = exact + 0.02 * torch.ones_like(exact)
    right = psnr(image, exact)
    assert psnr(image, truth.image(0, 0, "global")) < right - 10.0
    assert truth.cap(0, 0, "global") < right - 10.0
    assert truth.psnr(image, 0, 0, "global") == pytest.approx(right, abs=1.0)  # measured 0.4
    relative = float((image - exact).norm() / exact.norm())
    assert truth.relative_error(image, 0, 0, "global") == pytest.approx(relative, rel=0.1)  # measured 0.02
    half = torch.zeros(64, 64, dtype=torch.bool)
    half[:32] = True
    half_right = torch.where(half[..., None], exact, image)
    assert truth.psnr(half_right, 0, 0, "global", ~half) < right + 2.0 < truth.psnr(half_right, 0, 0, "global", half)


def test_no_image_is_called_better_than_the_noise_lets_us_tell(tmp_path: Path) -> None:
    exact = _synthetic(tmp_path, 0.1)
    truth = load_truth(tmp_path)
    # Measured: 41.1 dB with a cap of 23.6.
    assert truth.cap(0, 0, "global") + 10 < truth.psnr(exact, 0, 0, "global") < truth.cap(0, 0, "global") + 30


def test_pooling_is_the_mean_over_blocks_of_image_and_noise(tmp_path: Path) -> None:
    _synthetic(tmp_path, 0.1)
    truth = load_truth(tmp_path)
    small = truth.pooled(16)
    assert (small.resolution, small.image(0, 0, "direct").shape) == (16, (16, 16, 3))
    for whole, part in ((truth.images, small.images), (truth.noise, small.noise)):
        torch.testing.assert_close(part["global"][0, 0, 2, 5], whole["global"][0, 0, 8:12, 20:24].mean(dim=(0, 1)))
    with pytest.raises(ValueError, match="cannot be pooled to 24"):
        truth.pooled(24)


def test_a_folder_without_truth_or_with_broken_truth_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"truth\.json.*no such file"):
        load_truth(tmp_path)
    _synthetic(tmp_path, 0.1)
    path = tmp_path / "global/camera_0_light_0.exr"
    channels = read_channels(path)
    write_channels(path, {name: values[:32] for name, values in channels.items()})
    with pytest.raises(InputError, match=r"camera_0_light_0\.exr.*64 × 64 pixels.*64 × 32"):
        load_truth(tmp_path)
    write_channels(path, {name: values for name, values in channels.items() if "noise" not in name})
    with pytest.raises(InputError, match=r"camera_0_light_0\.exr: expected 6 channels"):
        load_truth(tmp_path)


def test_samples_that_cannot_be_halved_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="direct_samples must be even and at least 2, got 1"):
        render_truth(TABLETOP, tmp_path, resolution=16, samples=4)
    assert not list(tmp_path.iterdir())
