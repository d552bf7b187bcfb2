"""Colours of glTF files by its specification: factor times texture times colours of points, without metal."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mesh_files import QUARTERS, gltf_parts, painted, write_glb
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.errors import InputError
from rgspipe.scene import srgb

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648

#: The primitive, its accessor of places, and the material of a textured square.
UV = 2
LIGHT = srgb.decode(QUARTERS / 255.0)


def picture(levels: np.ndarray) -> dict:
    stream = io.BytesIO()
    Image.fromarray(levels).save(stream, "PNG")
    return {"uri": "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()}


def write(folder: Path, change: Callable[[dict, dict], None], colours: np.ndarray | None = None) -> Path:
    """A textured square, whose JSON and material are changed, with colours of its four points."""
    content, buffer = gltf_parts(folder)
    material = content["materials"][0]["pbrMetallicRoughness"]
    if colours is not None:
        kind = {"float32": 5126, "uint16": 5123, "uint8": 5121}[colours.dtype.name]
        content["bufferViews"].append({"buffer": 0, "byteOffset": len(buffer), "byteLength": colours.nbytes})
        content["accessors"].append(
            {"bufferView": len(content["bufferViews"]) - 1, "componentType": kind, "count": 4, "type": "VEC4"}
            | ({"normalized": True} if kind != 5126 else {})
        )
        content["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = len(content["accessors"]) - 1
        buffer += colours.tobytes()
        content["buffers"][0]["byteLength"] = len(buffer)
    change(content, material)
    return write_glb(folder / "a.glb", content, buffer)


def seen(path: Path) -> np.ndarray:
    """(4, 3) linear, to the levels that `painted` has."""
    return srgb.decode(painted(path) / 255.0)


def plain(content: dict, material: dict) -> None:
    del material["baseColorTexture"]


def nothing(content: dict, material: dict) -> None:
    """Leave it."""


def no_material(content: dict, material: dict) -> None:
    del content["meshes"][0]["primitives"][0]["material"]


def corners(path: Path) -> np.ndarray:
    return read_mesh(path).paint.corners[0, 0]


@pytest.mark.parametrize(
    ("colours", "value"),
    [
        (np.full((4, 4), 0.1, np.float32), 0.1),
        (np.full((4, 4), 51, np.uint8), 0.2),
        (np.full((4, 4), 6553, np.uint16), 6553 / 65535),
    ],
)
def test_colours_of_points_are_times_the_material(tmp_path: Path, colours: np.ndarray, value: float) -> None:
    """They were dropped where there is one."""
    half = [0.5, 0.25, 1.0, 1.0]
    for change, expected in {
        no_material: np.full(3, value),
        plain: np.full(3, value),
        lambda content, material: (plain(content, material), material.update(baseColorFactor=half)): value
        * np.array(half[:3]),
    }.items():
        # Off by 1.5e-9: float32.
        np.testing.assert_allclose(corners(write(tmp_path, change, colours)), expected, atol=1e-8)
    mesh = read_mesh(write(tmp_path, nothing, colours))
    # Off by 1.5e-9.
    np.testing.assert_allclose(mesh.paint.corners, value, atol=1e-8)
    assert len(mesh.paint.textures) == 1


def test_a_factor_is_not_rounded_to_bytes(tmp_path: Path) -> None:
    path = write(tmp_path, lambda content, material: material.update(baseColorFactor=[0.004, 0.0015, 0.02, 1]))
    np.testing.assert_array_equal(corners(path), [0.004, 0.0015, 0.02])


def test_what_metal_reflects_is_no_diffuse_reflectance(tmp_path: Path) -> None:
    path = write(tmp_path, lambda content, material: material.update(metallicFactor=0.75))
    np.testing.assert_array_equal(corners(path), [0.25] * 3)
    path = write(tmp_path, lambda content, material: (plain(content, material), material.update(metallicFactor=1.0)))
    np.testing.assert_array_equal(corners(path), [0.0] * 3)
    path = write(tmp_path, nothing)
    np.testing.assert_array_equal(corners(path), [1.0] * 3)  # exporters leave it out


@pytest.mark.parametrize("size", [2, 4, 8])
@pytest.mark.parametrize("factor", [None, 0.5])
def test_a_texture_may_say_what_is_metal(tmp_path: Path, size: int, factor: float | None) -> None:
    levels = np.zeros((size, size, 3), np.uint8)
    levels[..., :2], levels[: size // 2, : size // 2, 2] = 130, 255

    def change(content: dict, material: dict) -> None:
        content["images"].append(picture(levels))
        content["textures"].append({"source": 1})
        material["metallicRoughnessTexture"] = {"index": 1}
        if factor is not None:
            material["metallicFactor"] = factor

    expected = LIGHT.copy()
    expected[0] *= 0.0 if factor is None else 1.0 - factor
    # Off by 1.3e-3: half a level.
    np.testing.assert_allclose(seen(write(tmp_path, change)), expected, atol=3e-3)


def sampled(way: int | None) -> Callable[[dict, dict], None]:
    def change(content: dict, material: dict) -> None:
        content["samplers"] = [{} if way is None else {"wrapS": way, "wrapT": way}]
        content["textures"][0]["sampler"] = 0

    return change


def moved(path: Path, places: np.ndarray, way: int | None) -> Path:
    """With other places in the texture, from the upper left corner."""
    write(path.parent, sampled(way))
    content, buffer = gltf_parts(path.parent)
    sampled(way)(content, {})
    start = content["bufferViews"][content["accessors"][UV]["bufferView"]]["byteOffset"]
    given = np.asarray(places, np.float32).tobytes()
    return write_glb(path, content, buffer[:start] + given + buffer[start + len(given) :])


@pytest.mark.parametrize("way", [CLAMP, MIRROR])
def test_a_texture_that_does_not_repeat_is_refused_where_it_is_needed(tmp_path: Path, way: int) -> None:
    """It was repeated."""
    places = np.array([[1.2, 0.2], [1.4, 0.2], [1.4, 0.4], [1.2, 0.4]])
    with pytest.raises(InputError, match=r"a\.glb: expected textures that repeat .* places from .* to 1\.4"):
        read_mesh(moved(tmp_path / "a.glb", places, way))
    for repeats in (REPEAT, None):
        mesh = read_mesh(moved(tmp_path / "a.glb", places, repeats))
        found = mesh.paint.at(np.arange(2), np.full((2, 3), 1.0 / 3.0))
        # Off by 1.2e-8: float32.
        np.testing.assert_allclose(found, LIGHT[[0, 0]], atol=1e-7)


@pytest.mark.parametrize("way", [CLAMP, MIRROR])
def test_the_end_of_a_texture_that_does_not_repeat_is_not_its_begin(tmp_path: Path, way: int) -> None:
    for place, expected in {(1, 1): 3, (0, 0): 0, (1, 0): 1, (0, 1): 2}.items():
        mesh = read_mesh(moved(tmp_path / "a.glb", np.array([place] * 4), way))
        found = mesh.paint.at(np.arange(2), np.full((2, 3), 1.0 / 3.0))
        # Off by 1.2e-8: float32.
        np.testing.assert_allclose(found, LIGHT[[expected] * 2], atol=1e-7)


@pytest.mark.parametrize("mode", ["MASK", "BLEND"])
def test_it_is_said_that_what_one_sees_through_is_taken_for_opaque(tmp_path: Path, mode: str) -> None:
    assert read_mesh(write(tmp_path, nothing)).remarks == ()
    path = write(tmp_path, lambda content, material: content["materials"][0].update(alphaMode=mode))
    (remark,) = read_mesh(path).remarks
    assert "taken for opaque" in remark


def test_levels_of_16_bits_of_grey_are_not_cut_off(tmp_path: Path) -> None:
    """They were white."""

    def change(content: dict, material: dict) -> None:
        content["images"][0] = picture(np.full((4, 4), 30000, np.uint16))

    mesh = read_mesh(write(tmp_path, change))
    expected = srgb.decode(np.array(30000 / 65535))
    # Off by nothing.
    np.testing.assert_allclose(mesh.paint.textures[0], expected, atol=1e-7)
