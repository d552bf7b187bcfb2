"""Lamps shine as the equations of our lights say, whatever their profile."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rgspipe.datasets.exr import read_image
from spots_on_plane import hard_spots, lopsided_luminaire, plane_image, plane_lights, yellow_lights

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed"),
]


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory, child_environment: dict[str, str]) -> Path:
    """The images of lamp_in_blender.py."""
    folder = tmp_path_factory.mktemp("plane")
    command = [sys.executable, str(Path(__file__).with_name("lamp_in_blender.py")), str(folder)]
    done = subprocess.run(command, env=child_environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return folder


@pytest.mark.parametrize("name", plane_lights())
def test_cycles_renders_the_closed_form_of_every_profile(rendered: Path, name: str) -> None:
    image, expected = read_image(rendered / f"{name}.exr")[0], plane_image(plane_lights()[name])
    # 1024 samples inside a pixel against 256 subpixels, over the brightest pixel: 1.5e-4 for the point light, 1.0e-3
    # where the smoothstep's rim crosses a pixel; means differ by 1.7e-4 at most (the panel).
    np.testing.assert_allclose(image, expected, atol=2e-3 * expected.max())
    assert abs(image.mean() / expected.mean() - 1.0) < 2e-4


@pytest.mark.parametrize("name", yellow_lights())
def test_a_light_may_have_none_of_a_colour(rendered: Path, name: str) -> None:
    image, expected = read_image(rendered / f"{name}.exr")[0], plane_image(yellow_lights()[name])
    # As in all colours: at most 1.0e-3 of the brightest pixel and 1.7e-4 of the mean, both under the panel.
    np.testing.assert_allclose(image, expected, atol=2e-3 * expected.max())
    assert not image[..., 2].any() and abs(image.mean() / expected.mean() - 1.0) < 2e-4


def test_a_light_may_be_dark(rendered: Path) -> None:
    assert (rendered / "dark.txt").read_text() == "0.0 [0.0, 0.0, 0.0]"


@pytest.mark.parametrize("name", hard_spots())
def test_cycles_renders_hard_edges(rendered: Path, name: str) -> None:
    image, expected = read_image(rendered / f"{name}.exr")[0], plane_image(hard_spots()[name])
    assert float((expected == 0.0).mean()) > 0.3
    # Only pixels that the edge crosses differ: measured at most 0.012 of the brightest pixel, and 8e-4 of the mean.
    np.testing.assert_allclose(image, expected, atol=2e-2 * expected.max())
    assert abs(image.mean() / expected.mean() - 1.0) < 2e-3


def test_cycles_reads_a_measured_luminaire_as_we_do(rendered: Path) -> None:
    """With an interpolation of its own, between angles 2.5° and 7.5° apart."""
    image, expected = read_image(rendered / "luminaire.exr")[0], plane_image(lopsided_luminaire())
    # Measured 1.6e-3, and 2.4e-6 of the mean.
    assert np.abs(image / expected - 1.0).max() < 5e-3
    assert abs(image.mean() / expected.mean() - 1.0) < 1e-4


def test_our_smoothstep_is_blender_s_spot(rendered: Path) -> None:
    ours, blender = (read_image(rendered / f"{name}.exr")[0] for name in ("smoothstep", "blender"))
    # Same samples; measured 2.3e-6 of the brightest pixel.
    np.testing.assert_allclose(ours, blender, atol=2e-5 * blender.max())


def test_a_lamp_keeps_nothing_of_the_light_before(rendered: Path) -> None:
    assert (rendered / "again.exr").read_bytes() == (rendered / "point.exr").read_bytes()


def test_a_light_whose_extent_blender_has_no_lamp_for_is_refused(rendered: Path) -> None:
    told = (rendered / "refused.txt").read_text(encoding="utf-8")
    assert "a tube: expected a lamp in one point, a sphere, a rectangle or a sun" in told
