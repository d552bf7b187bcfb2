"""Other people's renderers photograph the same scene: held against closed forms, each by itself.

`make third-party` installs them; what is not installed is skipped.
"""

from __future__ import annotations

import importlib
import json
import math
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

TOOLS = Path(__file__).parents[2] / "tools"
NEEDED = {"mitsuba": "mitsuba", "radiance": "pyradiance", "luxcore": "pyluxcore"}
pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _tools(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))


@pytest.fixture(params=NEEDED)
def photograph(request: pytest.FixtureRequest) -> Callable[..., np.ndarray]:
    if importlib.util.find_spec(NEEDED[request.param]) is None:
        pytest.skip(f"{NEEDED[request.param]} is not installed (make third-party)")
    return importlib.import_module(f"foreign.by_{request.param}").photograph


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_a_floor_is_as_bright_as_its_lamp_makes_it(photograph: Callable[..., np.ndarray], radius: float) -> None:
    # Nothing bounces: ρ I cos θ / π d² in every pixel, of a ball as of a point, so a camera that is turned, mirrored,
    # one pixel off or of another lens shows. What a ball hides is as bright as its radiance.
    from foreign.cameras import PIXELS, Shot
    from foreign.shapes import Lamp, Shape

    colour, intensity, lamp = np.array([0.5, 0.4, 0.3]), [5.0, 3.0, 1.0], np.array([0.4, 0.1, 1.0])
    shot = Shot(np.array([0.1, -2.0, 1.5]), np.array([0.3, 0.2, 0.0]), 50.0)
    if radius and "luxcore" in photograph.__module__:
        pytest.skip("photographs points alone")
    floor = {"floor": Shape("rectangle", np.diag([50.0, 50, 1, 1]), colour)}
    image = photograph(floor, shot, [Lamp(lamp, np.array(intensity), radius)], 16, 1)
    rays = shot.rays()
    way = lamp - (shot.eye - shot.eye[2] / rays[:, 2:] * rays)
    square = (way**2).sum(axis=1, keepdims=True)
    expected = colour * intensity * way[:, 2:] / np.sqrt(square) / (math.pi * square)
    away = lamp - shot.eye
    distance = np.linalg.norm(away)
    # Angles between a ball's middle and its rim, and between pixels.
    rim, pixel = math.asin(radius / distance), 1.5 / shot.focal
    aside = np.arccos(rays @ away / distance)
    error = (image[..., :3].reshape(-1, 3) / expected - 1.0)[aside > rim + pixel]
    # Means 0.0002, deviations 0.005 (of balls up to 0.007): where its 16 paths fall. One pixel aside: 0.016, 0.058.
    assert image.shape == (PIXELS, PIXELS, 4) and (image[..., 3] == 1.0).all()
    assert np.abs(error.mean(axis=0)).max() < 0.001 and error.std() < 0.01
    ball = image[..., :3].reshape(-1, 3)[aside < rim - pixel] * math.pi * radius**2 / intensity
    assert (len(ball) > 5) == (radius > 0.0) and np.abs(ball - 1.0).max(initial=0.0) < 1e-4


def test_light_in_a_ball_bounces_for_ever(photograph: Callable[..., np.ndarray]) -> None:
    # A lamp in the middle of a ball of reflectance ρ and radius R: I ρ / (π R² (1 - ρ)) everywhere.
    from foreign.cameras import Shot
    from foreign.shapes import Lamp, Shape

    ball = Shape("sphere", np.eye(4), np.zeros(3))
    colour, radius = np.array([0.9, 0.6, 0.2]), 2.0
    inside = Shape("mesh", np.diag([radius, radius, radius, 1.0]), colour, ball.triangles())
    shot = Shot(np.array([0.5, -0.7, 0.2]), np.array([0.0, 1.0, 0.3]), 70.0)
    image = photograph({"inside": inside}, shot, [Lamp(np.array([1e-4, 2e-4, 0.0]), np.full(3, 3.0))], 4, 1)
    expected = 3.0 * colour / (math.pi * radius**2 * (1.0 - colour))
    # 0.0008 to 0.0012 of the colour that bounces longest, 0.0004 at most of the others.
    assert np.abs(image[..., :3].mean(axis=(0, 1)) / expected - 1.0).max() < 0.006


def test_a_ball_of_triangles_is_closed() -> None:
    from foreign.shapes import Shape

    vertices, faces = Shape("sphere", np.diag([2.0, 2, 2, 1]), np.ones(3)).triangles()
    a, b, c = vertices[faces].transpose(1, 0, 2)
    volume = np.einsum("nd,nd->n", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * math.pi * 8.0, rel=2e-3)  # 0.0009 too small


def test_rooms_are_rendered_by_everyone_who_is_asked(tmp_path: Path) -> None:
    for needed in ("mitsuba", "pyradiance"):
        pytest.importorskip(needed, reason=f"{needed} is not installed (make third-party)")
    folder = tmp_path / "room"
    options = ["--seed", "3", "--views", "1", "--samples", "1", "--targets", "mitsuba", "radiance"]
    command = [sys.executable, str(TOOLS / "foreign_room.py"), "object", str(folder), *options]
    subprocess.run(command, check=True, capture_output=True)
    targets = json.loads((folder / "targets" / "targets.json").read_text())["targets"]
    classes = ["visible", "out_of_frame", "occluded"]
    assert [target["name"] for target in targets] == [
        f"{one}_{by}" for one in classes for by in ("mitsuba", "radiance")
    ]
    lamps = [(folder / "truth" / f"visible_{by}.json").read_text() for by in ("mitsuba", "radiance")]
    assert lamps[0] == lamps[1] and len(list(folder.glob("targets/*/*.exr"))) == 18


def test_furniture_is_read_from_its_library(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    from foreign.furniture import pieces

    entries = [
        {"model": "/a/box.obj", "category": "Living room", "width": "80", "depth": "50", "height": "120"},
        {"model": "/a/box.obj", "category": "Exterior", "width": "80", "depth": "50", "height": "120"},
        {"model": "/a/box.obj", "category": "Office", "width": "80", "depth": "50", "height": "120", "elevation": "90"},
        {"model": "/a/gone.obj", "category": "Office", "width": "80", "depth": "50", "height": "120"},
        {"model": "/a/box.obj", "category": "Office", "width": "8", "depth": "5", "height": "12"},
    ]
    lines = [f"{key}#{number}={value}" for number, entry in enumerate(entries, 1) for key, value in entry.items()]
    # A wedge whose high edge is at the back: -z in its file, +y in a room.
    corners = ["v 0 0 0", "v 4 0 0", "v 4 0 -2", "v 0 0 -2", "v 0 3 -2", "v 4 3 -2"]
    faces = ["usemtl red", "f 1 2 3 4", "f 1 2 6 5", "usemtl black", "f 3 4 5 6", "f 1 5 4", "f 2 3 6"]
    with zipfile.ZipFile(tmp_path / "one.sh3f", "w") as library:
        library.writestr("PluginFurnitureCatalog.properties", "\n".join(lines))
        library.writestr("a/box.obj", "\n".join(["mtllib box.mtl", *corners, *faces]))
        library.writestr("a/box.mtl", "newmtl red\nKd 0.8 0.1 0.1\nnewmtl black\nKd 0 0 0\n")
    (piece,) = pieces(tmp_path)
    assert piece.size.tolist() == [0.8, 0.5, 1.2]
    parts = {tuple(np.round(colour, 2)): vertices for vertices, _, colour in piece.parts()}
    assert set(parts) == {(0.8, 0.1, 0.1), (0.05, 0.05, 0.05)}  # nothing reflects less than 5 %
    every = np.concatenate(list(parts.values()))
    assert every.min() == -1.0 and every.max() == 1.0
    assert (every[every[:, 2] > 0.0][:, 1] == 1.0).all()


def test_a_folder_without_furniture_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    from foreign.furniture import pieces

    with pytest.raises(SystemExit, match="has no furniture"):
        pieces(tmp_path)
