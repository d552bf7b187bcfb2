"""The scenes that are modelled here: where they are, of what, and that their targets are what they say."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from rgspipe.datasets.exr import read_channels, read_image
from rgspipe.scene import Camera, look_at
from rgspipe.scene.models import CornellBox, Corridor

pytestmark = pytest.mark.slow

CORNERS = {"corner": 0.32, "narrow_corner": 0.28, "wide_corner": 0.36}
ZOO = ("zoo_standing", "zoo_one_side", "zoo_open")
ALL = ("cornell", "hotdog", "room", *CORNERS)


@pytest.fixture(scope="module")
def measured(in_blender: Callable[..., None], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What models_in_blender.py leaves: of each scene in `scenes`, of the rest beside."""
    folder = tmp_path_factory.mktemp("models")
    in_blender(folder, "scenes", "normals", "plain_hotdog", "patterns", "glossy", script="models_in_blender.py")
    return folder


@pytest.fixture(scope="module")
def found(measured: Path) -> dict[str, dict]:
    """What was measured of each scene."""
    return {path.stem: json.loads(path.read_text()) for path in (measured / "scenes").glob("*.json")}


@pytest.mark.parametrize("name", [*ALL, *ZOO])
def test_a_scene_fills_the_unit_cube_and_is_diffuse(found: dict, name: str) -> None:
    lo, hi = np.array(found[name]["bounds"])
    assert (lo >= -0.5 - 1e-6).all() and (hi <= 0.5 + 1e-6).all()
    assert (hi - lo)[: 1 if name in ZOO else 2] == pytest.approx(1.0, abs=0.02)  # the hot dog's plate is 0.99 across
    assert found[name]["shaders"] == ["BSDF_DIFFUSE"]


def test_blender_and_exact_surfels_are_given_the_same_surfaces(found: dict) -> None:
    exact = {"cornell": CornellBox(), "corner": Corridor()}
    exact |= {"narrow_corner": Corridor(0.28, 0.35), "wide_corner": Corridor(0.36, 1.0)}
    for name, model in exact.items():
        area = float(model.rectangles().areas.sum())
        assert found[name]["area"] == pytest.approx(area, rel=1e-5)  # Blender's coordinates are float32


def test_cameras_of_a_zoo_stand_in_the_room_or_along_its_first_side(found: dict) -> None:
    standing, one_side, front = (np.array(found[name]["cameras"])[:, 1] - found[name]["bounds"][0][1] for name in ZOO)
    assert np.ptp(standing) > 0.3  # measured 0.54
    assert (one_side > 0.0).all() and float(one_side.max()) < 0.15  # of a depth of 1 at most
    assert (front < 0.0).all()


@pytest.mark.parametrize("name", ALL)
def test_cameras_and_lights_are_in_free_space_and_views_are_lit(found: dict, name: str) -> None:
    assert min(found[name]["room"]) >= 0.04
    assert min(found[name]["views_lit"]) >= 0.02


@pytest.mark.parametrize("name", ALL)
def test_every_class_of_targets_has_its_lights(found: dict, name: str) -> None:
    classes = ["visible", "out_of_frame", "occluded"] + (["around_corner"] if name in CORNERS else [])
    targets = found[name]["targets"]
    assert [target["class"] for target in targets] == [kind for kind in classes for _ in range(2)]
    for target in targets:
        if target["class"] == "visible":
            assert not any(target["blocked"])
        if target["class"] in ("occluded", "around_corner"):
            assert all(target["blocked"])
        if target["class"] == "around_corner":
            assert max(target["lit"]) <= 0.1
        else:
            assert target["lit"][0] >= 0.02


@pytest.mark.parametrize(("name", "width"), CORNERS.items())
def test_a_light_around_the_corner_is_in_the_other_leg_and_seen_from_nowhere(
    found: dict, name: str, width: float
) -> None:
    inner = np.array([0.5 - width, width - 0.5])
    targets = [target for target in found[name]["targets"] if target["class"] == "around_corner"]
    assert len(targets) == 2
    for target in targets:
        light = np.array(target["light"])
        assert light[0] > inner[0] and light[1] > inner[1]
        for origin in np.array(target["origins"]):
            assert origin[0] < inner[0] and origin[1] < inner[1]
            way = origin + np.linspace(0.0, 1.0, 1000)[:, None] * (light - origin)
            assert ((way[:, 0] < inner[0]) & (way[:, 1] > inner[1])).any()  # through the block between the legs


@pytest.mark.parametrize(("name", "width"), CORNERS.items())
def test_cameras_stand_in_both_legs_of_the_corridor_and_nowhere_else(found: dict, name: str, width: float) -> None:
    x, y = np.array(found[name]["cameras"]).T[:2]
    in_near_leg, in_far_leg = x < 0.5 - width, y > width - 0.5
    assert in_near_leg.any() and in_far_leg.any() and not (in_near_leg & in_far_leg).any()


def test_cameras_and_lights_of_the_hot_dog_are_above_the_table(found: dict) -> None:
    origins = np.array(found["hotdog"]["cameras"])
    radius = 0.5 * np.linalg.norm(np.subtract(*found["hotdog"]["bounds"]))
    distance = np.linalg.norm(origins, axis=1) / radius
    assert ((distance > 1.9 - 1e-6) & (distance < 2.3 + 1e-6)).all() and (origins[:, 2] > 0.1).all()
    for target in found["hotdog"]["targets"]:
        assert target["light"][2] > 0.0


def test_the_room_is_cluttered(found: dict) -> None:
    named = {"rug", "table top", "seat", "ball", "vase", "stool", "pot", "lampshade", "large crate"}
    assert len(named & set(found["room"]["objects"])) >= 8
    assert len(found["room"]["objects"]) > 30


def test_the_same_seed_gives_the_same_scene(found: dict) -> None:
    assert found["again"] == found["corner"]
    assert found["other_seed"]["cameras"] != found["corner"]["cameras"]


def test_smooth_normals_are_those_of_the_faces(measured: Path) -> None:
    for scene, turns in json.loads((measured / "normals.json").read_text()).items():
        for name, turn in turns.items():
            # Degrees, mean over the surface: measured 2.1 for the sauce, whose line is two pixels wide, 1.2 elsewhere.
            assert turn < (2.5 if name == "sauce" else 1.5), f"{scene}: {name}"


def test_the_hot_dog_has_alpha_and_the_colours_it_was_given(measured: Path) -> None:
    image, alpha = read_image(measured / "hotdog.exr")
    albedo = np.stack([read_channels(measured / "hotdog_albedo.exr")[channel] for channel in "RGB"], axis=-1)
    depth = read_channels(measured / "hotdog_depth.exr")["Z"]
    assert 0.2 < (alpha > 0.99).mean() < 0.8 and (alpha < 0.01).mean() > 0.2
    assert (image[alpha < 0.01] == 0).all()
    there = depth < 100
    assert (alpha[there] > 0.3).all() and (alpha[~there] < 0.7).all()  # a pixel's centre against all of it
    colours = {
        "plate": (0.78, 0.78, 0.76), "rim": (0.15, 0.25, 0.55), "crust": (0.62, 0.33, 0.11),
        "crumb": (0.82, 0.68, 0.44), "sausage": (0.5, 0.13, 0.06), "sauce": (0.8, 0.55, 0.03),
    }  # fmt: skip
    table = np.array(list(colours.values()))
    distance = np.abs(albedo[there][:, None] - table).max(axis=-1)
    assert distance.min(axis=1).max() < 5e-4  # half precision: measured 2.4e-4
    assert set(distance.argmin(axis=1)) == set(range(len(colours)))


def test_patterns_repeat_as_they_are_told(measured: Path) -> None:
    x, y = _seen_from_above()
    first, second = np.array([0.1, 0.2, 0.3]), np.array([0.7, 0.6, 0.5])
    cell = np.floor(x / 0.25) + np.floor(y / 0.25)
    inside = (np.abs(x / 0.25 - np.round(x / 0.25)) > 0.02) & (np.abs(y / 0.25 - np.round(y / 0.25)) > 0.02)
    expected = np.where((cell % 2 == 1)[..., None], first, second)
    np.testing.assert_allclose(_albedo(measured / "checker_albedo.exr")[inside], expected[inside], atol=5e-4)
    stripes = _albedo(measured / "stripes_albedo.exr")
    share = 0.5 - 0.5 * np.cos(2 * np.pi * x / 0.25 + _phase(x, stripes[..., 0]))
    expected = first + np.clip((share - 0.25) / 0.5, 0, 1)[..., None] * (second - first)
    np.testing.assert_allclose(stripes, expected, atol=5e-3)  # the phase is found to 1°, worth 3e-3 here


def test_a_glossy_material_is_the_lobe_of_the_model(measured: Path) -> None:
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.5, -1.2, 0.9]), torch.zeros(3)), 0.7, 16, 16)
    origins, directions, _ = camera.rays(subsamples=8)
    points = (origins + (-origins[:, 2] / directions[:, 2])[:, None] * directions).numpy()
    to_light = np.array([0.1, 0.6, 0.7]) - points
    distance = np.linalg.norm(to_light, axis=1)
    to_light /= distance[:, None]
    irradiance = to_light[:, 2] / distance**2
    cosine = np.maximum(0.0, (to_light * [1, 1, -1] * directions.numpy()).sum(axis=1))
    lobe = (0.3 * 22 / (2 * math.pi) * cosine**20 * irradiance).reshape(16, 16, 64).mean(axis=2)
    images = {name: read_image(measured / f"{name}.exr")[0] for name in ("glossy", "matte")}
    for channel, albedo in enumerate((0.4, 0.3, 0.2)):
        # 512 samples inside a pixel against 64 subpixels: measured 1.3e-3 for both.
        diffuse = (albedo / math.pi * irradiance).reshape(16, 16, 64).mean(axis=2)
        np.testing.assert_allclose(images["matte"][..., channel], diffuse, rtol=4e-3)
        np.testing.assert_allclose(images["glossy"][..., channel], diffuse + lobe, rtol=4e-3)
    assert lobe.max() > 3 * diffuse.max()
    np.testing.assert_array_equal(_albedo(measured / "glossy_albedo.exr"), _albedo(measured / "matte_albedo.exr"))


def _albedo(path: Path) -> np.ndarray:
    return np.stack([read_channels(path)[channel] for channel in "RGB"], axis=-1)


def _seen_from_above() -> tuple[np.ndarray, np.ndarray]:
    """x and y of the points behind the pixels of the patterns' camera."""
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.0, -1e-4, 2.0]), torch.zeros(3)), 0.5, 32, 32)
    origins, directions, _ = camera.rays()
    points = (origins + (-origins[:, 2] / directions[:, 2])[:, None] * directions).numpy()
    return points[:, 0].reshape(32, 32), points[:, 1].reshape(32, 32)


def _phase(x: np.ndarray, values: np.ndarray) -> float:
    """Where Blender's wave starts: the phase that fits best."""
    phases = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    share = 0.5 - 0.5 * np.cos(2 * np.pi * x / 0.25 + phases[:, None, None])
    expected = 0.1 + 0.6 * np.clip((share - 0.25) / 0.5, 0, 1)
    return float(phases[np.abs(expected - values).sum(axis=(1, 2)).argmin()])
