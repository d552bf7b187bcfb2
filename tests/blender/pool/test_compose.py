"""A pool on disk becomes targets that the usual loader reads, with the truth beside them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from rgspipe.blender.pool.compose import common_class, write_targets
from rgspipe.blender.pool.pool_file import read_pool, write_pool
from rgspipe.blender.pool.rigs import RigRequest, draw_rigs
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.light_file import read_lights
from rgspipe.errors import InputError
from rgspipe.scene import SpotLight
from spots_on_plane import plane_camera, plane_image, plane_lights


@pytest.fixture
def pool(tmp_path: Path) -> Path:
    """A point light and two spots over the plane, each of 1 W/sr, one camera, images in closed form."""
    lights = {name: plane_lights()[name] for name in ("point", "smoothstep", "gaussian")}
    ones = torch.ones(3, dtype=torch.float64)
    entries = []
    for number, (name, light) in enumerate(lights.items()):
        image = plane_image(light, 2) / light.intensity.numpy()
        write_image(tmp_path / f"pool/{name}/view_0.exr", image, np.full(image.shape[:2], 0.5 + 0.1 * number))
        entries.append((name, "visible" if name == "point" else "occluded", replace(light, intensity=ones)))
    write_pool(tmp_path / "pool", "plane", entries, [plane_camera()], [[-4.0] * 3, [4.0] * 3], 1.0, [0.0] * 3)
    return tmp_path / "pool"


def test_a_pool_is_read_as_it_was_written(pool: Path) -> None:
    lights = read_pool(pool)
    assert [light.occlusion for light in lights] == ["visible", "occluded", "occluded"]
    assert isinstance(lights[1].light, SpotLight) and lights[1].light.profile == "smoothstep"
    np.testing.assert_allclose(lights[0].brightness(), lights[0].image(0)[0].mean(axis=(0, 1)), rtol=1e-6)


def test_targets_are_the_images_of_their_true_lights(pool: Path, tmp_path: Path) -> None:
    lights = read_pool(pool)
    brightness = np.array([light.brightness() for light in lights])
    request = RigRequest(6, (1, 2), weakest=0.05, separation=0.0)
    rigs = draw_rigs([light.light for light in lights], brightness, request)
    (tmp_path / "made").mkdir()
    write_targets(pool, lights, rigs, tmp_path / "made")
    targets = load_dataset(tmp_path / "made", train=False, test=False).targets
    assert len(targets) == 6 and {len(rig.lights) for rig in rigs} == {1, 2}
    for target, rig in zip(targets, rigs, strict=True):
        truth = read_lights(tmp_path / "made/truth" / f"{target.name}.json")
        assert all(torch.equal(a.intensity, b.intensity) for a, b in zip(truth, rig.lights, strict=True))
        expected = sum(plane_image(light, 2) for light in truth)
        np.testing.assert_allclose(target.views[0].image, expected, rtol=1e-5, atol=1e-7)  # float32: measured 3e-7
        assert torch.equal(target.views[0].camera.camera_to_world, plane_camera().camera_to_world.double())
        alpha = np.mean([0.5 + 0.1 * member for member in rig.members])
        np.testing.assert_allclose(target.views[0].alpha, alpha, rtol=1e-6)
        assert target.occlusion == common_class([lights[member].occlusion for member in rig.members])


def test_lights_of_several_classes_have_none() -> None:
    assert common_class(["occluded", "occluded"]) == "occluded"
    assert common_class(["occluded", "visible"]) == "unknown"


def test_a_missing_image_is_named(pool: Path) -> None:
    (pool / "gaussian/view_0.exr").unlink()
    with pytest.raises(InputError, match=r"gaussian/view_0\.exr.*no such file"):
        read_pool(pool)[2].brightness()
