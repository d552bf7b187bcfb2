"""The script for Blender makes lamps that Cycles renders like ours."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rgspipe.datasets.exr import read_image
from rgspipe.light_export.export import export_lights
from spots_on_plane import plane_image, plane_lights

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed"),
]

#: A scene unit in metres: the image is that of our own units.
METRES = 10.0


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory, child_environment: dict[str, str]) -> Path:
    """The images of export_in_blender.py."""
    folder = tmp_path_factory.mktemp("exported")
    for name, light in plane_lights().items():
        export_lights(light, folder / name, ["blend"], metres=METRES)
    command = [sys.executable, str(Path(__file__).with_name("export_in_blender.py")), str(folder), str(METRES)]
    done = subprocess.run(command, env=child_environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return folder


@pytest.mark.parametrize("name", plane_lights())
def test_cycles_renders_what_was_exported(rendered: Path, name: str) -> None:
    image, expected = read_image(rendered / f"{name}.exr")[0], plane_image(plane_lights()[name])
    # Measured at most 1.1e-3 of the brightest pixel, and 1.7e-4 of the mean, both of the panel.
    np.testing.assert_allclose(image, expected, atol=5e-3 * expected.max())
    assert abs(image.mean() / expected.mean() - 1.0) < 1e-3


def test_a_file_of_its_own_can_be_saved(rendered: Path) -> None:
    assert (rendered / "saved.blend").read_bytes()[:4] in (b"BLEN", b"\x28\xb5\x2f\xfd")
