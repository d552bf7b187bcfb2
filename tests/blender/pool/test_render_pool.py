"""A pool of spots in the corridor, tiny: what it holds, and that damage does not change it."""

from __future__ import annotations

import hashlib
import importlib.util
from pathlib import Path

import numpy as np
import pytest

from rgspipe.blender.job import DatasetJob
from rgspipe.blender.pool.job import PoolJob, SpotRange
from rgspipe.blender.pool.lamps import LampRange
from rgspipe.blender.pool.pool_file import PooledLight, read_pool
from rgspipe.blender.pool.render_pool import render_pool
from rgspipe.errors import InputError
from rgspipe.scene import SpotLight
from rgspipe.scene.lights import PanelLight
from rgspipe.scene.models import Corridor
from rgspipe.store.whole_files import RECORD

CLASSES = ("visible", "out_of_frame", "occluded", "around_corner")
DATASET = DatasetJob(scene="corner", model=Corridor(), resolution=16, samples=4, seed=2)
JOB = PoolJob(DATASET, "spots", 4, CLASSES, SpotRange(cone_angle=(0.35, 0.5), falloff=(0.1, 0.3)), 1)


def test_without_bpy_the_way_out_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"Blender.*pip install.*Take the dataset's own"):
        render_pool(JOB, tmp_path, otherwise="Take the dataset's own.")


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("bpy is not installed")
    folder = tmp_path_factory.mktemp("pool")
    render_pool(JOB, folder)
    return folder


@pytest.fixture
def pool(rendered: Path) -> list[PooledLight]:
    return read_pool(rendered)


@pytest.mark.slow
def test_it_holds_a_spot_of_each_class_that_lights_the_view(pool: list[PooledLight]) -> None:
    assert [light.occlusion for light in pool] == list(CLASSES)
    for pooled in pool:
        assert isinstance(pooled.light, SpotLight) and pooled.light.intensity.tolist() == [1.0] * 3
        assert 0.35 <= pooled.light.cone_angle <= 0.5 and 0.1 <= pooled.light.falloff <= 0.3
        image, alpha = pooled.image(0)
        assert image.shape == (16, 16, 3) and (alpha == 1.0).all()
        # Measured 0.06 around the corner, 0.23 to 0.33 elsewhere.
        assert 0.01 < image.mean() < 1.0 and (image.max(axis=(0, 1)) > 0.0).all()


@pytest.mark.slow
def test_a_damaged_image_is_rendered_again_and_is_the_same(rendered: Path) -> None:
    files = [path for path in sorted(rendered.rglob("*")) if path.is_file() and path.name != RECORD]
    before = {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
    gone, cut = (rendered / f"light_{number:04d}/view_0.exr" for number in (1, 3))
    gone.unlink()
    cut.write_bytes(cut.read_bytes()[:-200])
    render_pool(JOB, rendered)
    assert {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files} == before


@pytest.mark.slow
def test_another_job_s_folder_is_refused(rendered: Path) -> None:
    with pytest.raises(InputError, match=r"job\.json.*differs in number"):
        render_pool(PoolJob(DATASET, "spots", 5, CLASSES, JOB.spot, 1), rendered)
    assert np.isfinite(read_pool(rendered)[0].brightness()).all()


@pytest.mark.slow
def test_lamps_hang_on_surfaces_and_look_out_of_them_but_for_spots(tmp_path: Path) -> None:
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("bpy is not installed")
    panels, spots = tmp_path / "panels", tmp_path / "spots"
    render_pool(PoolJob(DATASET, "panels", 3, ("visible",), views=1), panels)
    render_pool(PoolJob(DATASET, "spots", 1, ("visible",), views=1, lamps=LampRange(mounted=(0.01, 0.05))), spots)
    for pooled in read_pool(panels):
        assert isinstance(pooled.light, PanelLight)
        assert pooled.light.axis.abs().max() == 1.0  # walls, floor and ceiling of the corridor lie along the axes
    (pooled,) = read_pool(spots)
    assert isinstance(pooled.light, SpotLight)
