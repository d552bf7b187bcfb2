"""What a visitor takes home is whole."""

from __future__ import annotations

import io
import math
import zipfile

import torch

from rgspipe.light_export.world import World
from rgspipe.scene import Camera, PointLight
from rgspipe.viewer.saving import FRAMES, SWING, exported, swing


def test_lamps_for_all_programs_are_in_one_file() -> None:
    with zipfile.ZipFile(io.BytesIO(exported((PointLight([0.0, 0.0, 0.5], 1.0),), World(2.0)))) as archive:
        names = set(archive.namelist())
        assert b"1.0" in archive.read("lamps.json")  # half a unit of two metres each
    assert {"lamps_blender.py", "lamps.usda", "lamps.gltf", "lamps_mitsuba.xml", "lamps_three.json"} <= names
    assert {"lamp_1.ies", "lamps.txt"} <= names


def test_light_from_all_around_goes_along() -> None:
    zipped = exported((PointLight([0.0, 0.0, 0.5], 1.0),), World(), torch.tensor([0.5, 0.25, 1.0]))
    with zipfile.ZipFile(io.BytesIO(zipped)) as archive:
        assert b'"ambient"' in archive.read("lamps.json") and "all around" in archive.read("lamps.txt").decode()


def test_what_the_fit_doubted_and_where_lamps_may_be_goes_along() -> None:
    lamp, doubt = PointLight([0.0, 0.0, 0.5], 1.0), "The fit that found these lights is ambiguous: by two rivals."
    zipped = exported((lamp,), World(2.0), None, (0.01 * torch.eye(6).double(),), [doubt])
    with zipfile.ZipFile(io.BytesIO(zipped)) as archive:
        assert doubt in archive.read("lamps.txt").decode()
        script = archive.read("lamps_blender.py").decode()
    with zipfile.ZipFile(io.BytesIO(exported((lamp,), World(2.0)))) as archive:
        assert len(archive.read("lamps_blender.py").decode()) < len(script), "an ellipsoid is drawn there"


def test_a_swing_goes_to_both_sides_and_looks_at_one_point() -> None:
    camera = Camera.look_at([0.0, -2.0, 0.3], [0.0, 0.0, 0.0], width=16, height=12)
    frames = swing(camera, torch.zeros(3, dtype=torch.float64))
    assert len(frames) == FRAMES and {(one.width, one.height) for one in frames} == {(16, 12)}
    torch.testing.assert_close(frames[0].camera_to_world, camera.camera_to_world, atol=1e-12, rtol=0.0)
    sides = [math.degrees(math.atan2(float(one.origin[0]), -float(one.origin[1]))) for one in frames]
    assert math.isclose(max(sides), SWING, abs_tol=0.5) and math.isclose(min(sides), -SWING, abs_tol=0.5)
    for one in frames:
        (x, y), _ = one.project(torch.zeros(3, dtype=torch.float64))
        assert math.isclose(float(x), 8.0, abs_tol=1e-9) and math.isclose(float(y), 6.0, abs_tol=1e-9)


def test_a_camera_that_looks_away_swings_as_well() -> None:
    away = Camera.look_at([0.0, -2.0, 0.0], [0.0, -4.0, 0.0])
    assert all(one.camera_to_world.isfinite().all() for one in swing(away, torch.zeros(3, dtype=torch.float64)))
