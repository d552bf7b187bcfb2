"""A capture in another program's layout on its way to lamps: what is checked of it, and the whole way."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from lit_room import BOX_CENTER, BOX_SIZE
from photographed_room import LAMPS, photographs
from raycast import ROOM, Cuboid, cast
from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.graph import pipeline
from rgspipe.stages import load_stage
from rgspipe.stages.base import StageContext
from rgspipe.stages.images.generate_dataset import STAGE as GENERATE
from rgspipe.stages.images.import_scan import STAGE
from scan_layouts import FLIP, photographed, write_nerfstudio

Change = Callable[[np.ndarray], np.ndarray]


def config(root: Path, **rgbd: object) -> RgspipeConfig:
    changes = {"scene.kind": "rgbd", "scene.lamps": "unknown", "scene.path": str(root)}
    return with_changes(RgspipeConfig(), changes | {f"scene.rgbd.{key}": value for key, value in rgbd.items()})


def imported(root: Path, folder: Path, **rgbd: object) -> StageContext:
    folder.mkdir(exist_ok=True)
    context = StageContext(config(root, **rgbd), {}, {}, folder)
    STAGE.run(context)
    return context


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    """Twelve photographs of a room, 8-bit, with depth in millimetres."""
    root = tmp_path / "scan"
    write_nerfstudio(root, photographed(), ".png", ".png")
    return root


def change(root: Path, matrices: Change | None = None, **shared: object) -> None:
    """Write (12, 4, 4) matrices anew, and top-level keys."""
    path = root / "transforms.json"
    content = json.loads(path.read_text()) | shared
    if matrices is not None:
        values = matrices(np.array([frame["transform_matrix"] for frame in content["frames"]]))
        for frame, value in zip(content["frames"], values, strict=True):
            frame["transform_matrix"] = value.tolist()
    path.write_text(json.dumps(content))


def test_a_capture_is_imported_and_its_facts_are_kept(capture: Path, tmp_path: Path) -> None:
    facts = imported(capture, tmp_path / "out").facts
    assert facts == {"layout": "nerfstudio", "frames": 12, "with_depth": 12, "exif": False}


@pytest.mark.parametrize(
    ("matrices", "shared", "words"),
    [
        (lambda m: m @ FLIP, {}, ["OpenCV axes", "scene.rgbd.axes=opencv"]),
        (np.linalg.inv, {}, ["world-to-camera", "Invert every matrix"]),
        (None, {"depth_unit_scale_factor": 1.0}, ["depth times 0.001", "scene.rgbd.depth_unit"]),
        (lambda m: m[:, [1, 0, 2, 3]], {}, ["mirrored", "rows that were exchanged", "frames[0]"]),
        (lambda m: m @ np.diag([1.0, 1.0, -1.0, 1.0]), {}, ["mirrored", "two axes"]),
        (lambda m: m.swapaxes(1, 2), {}, ["transposed"]),
        (lambda m: 2.0 * m * [[1], [1], [1], [0.5]], {}, ["RᵀR", "scale"]),
        (lambda m: np.roll(m, 1, axis=0), {}, ["order of the images"]),
    ],
    ids=["opencv", "inverse", "unit", "rows", "mirrored", "transposed", "scaled", "other frames"],
)
def test_what_was_written_by_another_convention_is_refused_by_its_name(
    capture: Path, tmp_path: Path, matrices: Change | None, shared: dict, words: list[str]
) -> None:
    change(capture, matrices, **shared)
    with pytest.raises(InputError) as caught:
        imported(capture, tmp_path / "out")
    assert "transforms.json" in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_rows_of_rotations_in_another_order_than_those_of_places_fit_nothing(capture: Path, tmp_path: Path) -> None:
    def turned(matrices: np.ndarray) -> np.ndarray:
        matrices = matrices.copy()
        matrices[:, :3, :3] = matrices[:, [2, 0, 1], :3]
        return matrices

    change(capture, turned)
    with pytest.raises(InputError, match="rows of matrices"):
        imported(capture, tmp_path / "out")


def test_what_errors_say_helps(capture: Path, tmp_path: Path) -> None:
    change(capture, lambda m: m @ FLIP, depth_unit_scale_factor=1.0)
    facts = imported(capture, tmp_path / "out", axes="opencv", depth_unit=0.001).facts
    assert facts["with_depth"] == 12


def test_only_files_of_frames_that_are_taken_count(capture: Path) -> None:
    files = STAGE.files(config(capture, frames=3))
    assert [path.name for path in files] == ["transforms.json", *(f"{i}.png" for i in (0, 0, 6, 6, 11, 11))]


def test_the_dataset_of_a_capture_is_what_was_imported() -> None:
    assert [need.stage for need in GENERATE.needs(config(Path("scan")))] == ["import_scan"]
    assert GENERATE.needs(RgspipeConfig()) == ()


def test_lamps_of_a_capture_are_not_known() -> None:
    with pytest.raises(InputError, match=r"scene\.lamps.*unknown"):
        with_changes(RgspipeConfig(), {"scene.kind": "rgbd"})


def with_depth(view: View) -> View:
    """The true depth of the room of `lit_room`."""
    _, directions, lengths = view.camera.rays()
    box = Cuboid(BOX_CENTER, (BOX_SIZE,) * 3)
    distance, _ = cast([ROOM, box], view.camera.origin.numpy(), directions.numpy())
    depth = torch.from_numpy(distance / lengths.numpy()).float().reshape(view.alpha.shape)
    return replace(view, depth=depth)


@pytest.mark.slow
def test_a_capture_goes_all_the_way_to_its_lamp(tmp_path: Path) -> None:
    views = photographs(LAMPS[:1], resolution=48)
    # As a camera would expose: the brightest hundredth is clipped.
    white = float(np.quantile(torch.stack([view.image for view in views]).numpy(), 0.99))
    views = [with_depth(replace(view, image=view.image / white)) for view in views]
    write_nerfstudio(tmp_path / "room", views, ".png", ".png")
    overrides = ["stage=capture_surfels", "scene=rgbd", f"scene.path={tmp_path / 'room'}", f"outputs={tmp_path}/out"]
    overrides += ["init.surfels=900", "lamps.count=1", "lamps.gather_rays=64", "lamps.grid=4", "lamps.supersampling=2"]
    made = pipeline.run(compose_config(overrides), load_stage)
    (lamp,) = read_lights(made.file("lamps.json"))
    # Measured: 0.0122 in a room of side 1, and 0.974.
    error = float((lamp.position - LAMPS[0].position).norm())
    ratio = float((lamp.intensity * white / LAMPS[0].intensity).mean())
    assert error < 0.02, error
    assert abs(ratio - 1.0) < 0.1, ratio


def test_images_of_the_next_frame_are_refused(capture: Path, tmp_path: Path) -> None:
    """Poses and depth agree with each other, so that nothing was said."""
    path = capture / "transforms.json"
    content = json.loads(path.read_text())
    names = [frame["file_path"] for frame in content["frames"]]
    for frame, name in zip(content["frames"], [*names[1:], names[0]], strict=True):
        frame["file_path"] = name
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"taken for those of the previous frame.*Put each image to the frame after"):
        imported(capture, tmp_path / "imported")


def test_a_single_photograph_that_stands_elsewhere_is_named(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def moved(poses: np.ndarray) -> np.ndarray:
        poses[5, :3, 3] += (0.25, 0.0, 0.0)
        return poses

    imported(capture, tmp_path / "right")
    assert "warning" not in capsys.readouterr().out
    change(capture, moved)
    imported(capture, tmp_path / "moved")
    name = Path(json.loads((capture / "transforms.json").read_text())["frames"][5]["file_path"]).name
    assert f"warning: {name}: " in capsys.readouterr().out


def test_a_capture_that_measured_nothing_is_refused_where_it_is_read(capture: Path, tmp_path: Path) -> None:
    """It was imported, and refused by the next stage with the keys of another layout."""
    for path in (capture / "depth").iterdir():
        Image.fromarray(np.zeros((32, 32), np.uint16)).save(path)
    with pytest.raises(InputError, match=r"transforms\.json.*expected depth that is known.*found none in any of 12"):
        imported(capture, tmp_path / "imported")


def test_photographs_that_are_all_black_are_refused_where_they_are_read(capture: Path, tmp_path: Path) -> None:
    for path in (capture / "images").iterdir():
        Image.fromarray(np.zeros((32, 32, 3), np.uint8)).save(path)
    with pytest.raises(InputError, match=r"transforms\.json.*images that are black.*Switch the lamps on"):
        imported(capture, tmp_path / "imported")


def test_masks_the_wrong_way_round_are_told(capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    levels = np.zeros((32, 32), np.uint8)
    levels[:8] = 255
    Image.fromarray(levels).save(capture / "mask.png")
    content = json.loads((capture / "transforms.json").read_text())
    for frame in content["frames"]:
        frame["mask_path"] = "mask.png"
    (capture / "transforms.json").write_text(json.dumps(content))
    imported(capture, tmp_path / "imported")
    assert "warning: masks or alpha leave out 75 %" in capsys.readouterr().out
    Image.fromarray(0 * levels).save(capture / "mask.png")
    with pytest.raises(InputError, match=r"mask\.png: expected a mask .* found black everywhere\. Invert it"):
        imported(capture, tmp_path / "black")
