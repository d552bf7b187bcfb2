"""scene=mesh: surfaces from a mesh, and photographs with poses but without depth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from lit_room import BOX_CENTER, BOX_SIZE
from mesh_files import joined, write_coloured
from photographed_room import LAMPS, photographs
from raycast import ROOM, Cuboid
from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import load_views
from rgspipe.errors import InputError
from rgspipe.graph import pipeline
from rgspipe.stages import load_stage
from rgspipe.stages.images.import_scan import STAGE
from scan_layouts import write_nerfstudio

BOXES = (ROOM, Cuboid(BOX_CENTER, (BOX_SIZE,) * 3))

#: Grey at the corners of the mesh, display values.
GREY = np.full((48, 3), 188, np.uint8)


def configured(root: Path, stage: str, *overrides: str) -> RgspipeConfig:
    return compose_config(
        [f"stage={stage}", "scene=mesh", f"scene.path={root / 'room.ply'}", f"outputs={root}/out", *overrides]
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """room.ply beside transforms.json and fourteen 8-bit photographs under one lamp."""
    root = tmp_path_factory.mktemp("mesh_scene")
    views = photographs(LAMPS[:1], resolution=48)
    white = float(np.quantile(torch.stack([view.image for view in views]).numpy(), 0.99))
    views = [replace(view, image=view.image / white) for view in views]
    write_nerfstudio(root, views, ".png", None)
    write_coloured(root / "room.ply", *joined(*BOXES), GREY)
    (root / "white.txt").write_text(repr(white))
    return root


@pytest.mark.slow
def test_a_mesh_and_photographs_go_all_the_way_to_the_lamp(folder: Path) -> None:
    small = ["init.surfels=900", "lamps.count=1", "lamps.gather_rays=64", "lamps.grid=4", "lamps.supersampling=2"]
    made = pipeline.run(configured(folder, "capture_surfels", *small), load_stage)
    (lamp,) = read_lights(made.file("lamps.json"))
    white = float((folder / "white.txt").read_text())
    error = float((lamp.position - LAMPS[0].position).norm())
    ratio = float((lamp.intensity * white / LAMPS[0].intensity).mean())
    # Measured: 0.0142 in a room of side 1, and 0.982.
    assert error < 0.02, error
    assert abs(ratio - 1.0) < 0.1, ratio


def test_depth_and_colours_of_the_mesh_are_those_of_the_views(folder: Path) -> None:
    views = load_views(pipeline.run(configured(folder, "import_scan"), load_stage).folder())
    assert all(bool(view.depth.isfinite().all()) for view in views)
    assert all(view.normal is not None for view in views)
    # Level 188 is 0.503 of light.
    assert all(float((view.albedo - 0.503).abs().max()) < 1e-3 for view in views)


def test_files_of_mesh_and_photographs_count(folder: Path) -> None:
    files = STAGE.files(configured(folder, "import_scan"))
    assert {path.name for path in files} == {"room.ply", "transforms.json", *(f"{i}.png" for i in range(14))}


def test_photographs_may_lie_elsewhere(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "room.ply").write_bytes((folder / "room.ply").read_bytes())
    with pytest.raises(InputError, match="a capture in one of these layouts"):
        STAGE.files(configured(tmp_path, "import_scan"))
    moved = configured(tmp_path, "import_scan", f"scene.mesh.photographs={folder}")
    assert len(STAGE.files(moved)) == 16


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["scene.rgbd.axes=opencv"], r"OpenGL axes.*scene\.rgbd\.axes=opengl"),
        (["scene.mesh.up=y"], r"mesh whose z is up.*scene\.mesh\.up=z"),
        (["scene.mesh.unit=1000"], r"times 0\.001.*scene\.mesh\.unit=1"),
    ],
)
def test_settings_that_do_not_suit_the_photographs_are_refused(folder: Path, overrides: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        pipeline.run(configured(folder, "import_scan", *overrides), load_stage)
