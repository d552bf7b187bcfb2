"""glTF files and GLBs that claim what they have not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from mesh_files import QUARTERS, gltf_parts, painted, write_glb
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.datasets.mesh.options import MeshOptions
from rgspipe.datasets.reading_limits import ReadingLimits, reading_within
from rgspipe.errors import InputError

#: The accessor of places in the texture, in the files that are written here.
UV = 2

#: The node that has the mesh in them.
SQUARE = 0

#: Where something of a textured square's JSON is changed, what it becomes (None: nothing), and words of the refusal.
CLAIMS: dict[str, tuple[tuple, object, str]] = {
    "points in no buffer": (("accessors", 0, "bufferView"), None, "compressed or sparse ones, or none"),
    "many points": (("accessors", 0, "count"), 100_000_000, "at most 20000000 triangles, found 100000000 entries"),
    "more points than bytes": (("accessors", 0, "count"), 1000, "entries that are there, found"),
    "entries within each other": (("bufferViews", 0, "byteStride"), 1, "entries that are there, found"),
    "a view beyond its buffer": (("bufferViews", 0, "byteLength"), 10**9, "bytes, where its buffer has"),
    "a negative count": (("accessors", 0, "count"), -1, "accessors[0].count: expected a whole number"),
    "a fan": (("meshes", 0, "primitives", 0, "mode"), 6, "triangles or strips"),
    "what must be understood": (("extensionsRequired",), ["KHR_mesh_quantization"], "KHR_mesh_quantization"),
    "colours in other words": (
        ("extensionsUsed",),
        ["KHR_materials_pbrSpecularGlossiness"],
        "KHR_materials_pbrSpecularGlossiness",
    ),
    "places of other points": (("accessors", UV, "count"), 3, "TEXCOORD_0: expected 4 entries, one a point, found 3"),
    "metal beyond all": (
        ("materials", 0, "pbrMetallicRoughness", "metallicFactor"),
        1.5,
        "metallicFactor: expected a number from 0 to 1",
    ),
    "metal in no picture": (
        ("materials", 0, "pbrMetallicRoughness", "metallicRoughnessTexture"),
        {"index": 7},
        "index: expected the number of one of 1",
    ),
    "no such sampler": (("textures", 0, "sampler"), 0, "sampler: expected the number of one of 0"),
    "turned textures": (("extensionsUsed",), ["KHR_texture_transform"], "KHR_texture_transform"),
    "a colour outside of the folder": (("images", 0), {"uri": "../t.png"}, "the folder of the mesh or below"),
    "a colour that is not there": (("images", 0), {"uri": "t.png"}, "t.png: expected a texture that a.glb names"),
    "a colour that is no picture": (("images", 0), {"uri": "data:;base64,AAAA"}, "texture in another format"),
    "another set of places in it": (
        ("materials", 0, "pbrMetallicRoughness", "baseColorTexture", "texCoord"),
        1,
        "one set of texture coordinates",
    ),
    "places that are shares": (("accessors", UV, "componentType"), 5121, "TEXCOORD_0: expected types of numbers"),
    "numbers of points below 0": (("accessors", 0, "componentType"), 5122, "indices: expected types of numbers"),
    "a colour of 7": (
        ("materials", 0, "pbrMetallicRoughness", "baseColorFactor"),
        [7, 7, 7, 1],
        "numbers from 0 to 1",
    ),
    "a material of no number": (("meshes", 0, "primitives", 0, "material"), -1, "material: expected a whole number"),
    "materials that are none": (("materials",), 7, "materials: expected a list of objects"),
    "a mesh of no number": (("nodes", 0, "mesh"), 7, "nodes[0].mesh: expected the number of one of 1"),
    "nodes below each other": (
        ("nodes",),
        [{"mesh": 0}, {"children": [2]}, {"children": [1]}],
        "a node that is its own descendant",
    ),
    "a node below itself": (("nodes",), [{"mesh": 0, "children": [0]}], "a node that is its own descendant"),
    "a node of two parents": (
        ("nodes",),
        [{"children": [2]}, {"children": [2]}, {"mesh": 0}],
        "found two: nodes[0] and nodes[1]",
    ),
    "a child of no number": (("nodes",), [{"mesh": 0, "children": [9]}], "children: expected the number of one of 1"),
    "a skeleton": (("nodes", SQUARE, "skin"), 0, f"nodes[{SQUARE}].skin: expected a mesh that stands still"),
    "another shape": (("nodes", SQUARE, "weights"), [0, 0.5], f"nodes[{SQUARE}].weights: expected a mesh of one shape"),
    "another shape of all": (("meshes", 0, "weights"), [1], "weights: expected a mesh of one shape"),
    "an old version": (("asset", "version"), "1.0", "asset.version: expected 2.0"),
    "a picture of no number": (("textures", 0, "source"), 7, "textures[0].source: expected the number of one of 1"),
}


@pytest.mark.parametrize("case", CLAIMS)
def test_a_glb_that_claims_what_it_has_not_is_refused_before_it_is_decoded(tmp_path: Path, case: str) -> None:
    content, buffer = gltf_parts(tmp_path)
    assert np.array_equal(painted(write_glb(tmp_path / "a.glb", content, buffer)), QUARTERS)
    (*way, key), value, words = CLAIMS[case]
    holder = content
    for step in way:
        holder = holder[step]
    if value is None:
        del holder[key]
    else:
        holder[key] = value
    with pytest.raises(InputError, match=re.escape(words)):
        read_mesh(write_glb(tmp_path / "a.glb", content, buffer))


def test_shapes_without_a_weight_change_nothing(tmp_path: Path) -> None:
    content, buffer = gltf_parts(tmp_path)
    content["meshes"][0]["weights"], content["nodes"][SQUARE]["weights"] = [1.0], [0.0]
    assert np.array_equal(painted(write_glb(tmp_path / "a.glb", content, buffer)), QUARTERS)


def test_a_file_without_a_scene_has_all_that_is_in_it(tmp_path: Path) -> None:
    """Nothing was found in it."""
    content, buffer = gltf_parts(tmp_path)
    del content["scenes"], content["scene"]
    assert np.array_equal(painted(write_glb(tmp_path / "a.glb", content, buffer)), QUARTERS)


def test_what_hangs_on_a_camera_is_where_it_is(tmp_path: Path) -> None:
    """It was left out, or stood at the origin."""
    content, buffer = gltf_parts(tmp_path)
    content["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    content["nodes"] += [{"camera": 0, "translation": [0, 0, 5.0], "children": [SQUARE]}]
    for node in content["nodes"][:-1]:
        node.pop("children", None)
    content["scenes"][0]["nodes"] = [len(content["nodes"]) - 1]
    mesh = read_mesh(write_glb(tmp_path / "a.glb", content, buffer), MeshOptions(up="z"))
    np.testing.assert_allclose(mesh.vertices[:, 2], 5.0)


def test_a_mesh_at_many_nodes_counts_as_often(tmp_path: Path) -> None:
    content, buffer = gltf_parts(tmp_path)
    mesh = next(number for number, node in enumerate(content["nodes"]) if "mesh" in node)
    content["nodes"] += [content["nodes"][mesh] | {"name": f"copy {number}"} for number in range(30)]
    content["scenes"][0]["nodes"] += list(range(len(content["nodes"]) - 30, len(content["nodes"])))
    path = write_glb(tmp_path / "a.glb", content, buffer)
    assert len(read_mesh(path)) == 62
    with reading_within(ReadingLimits(vertices=30)), pytest.raises(InputError, match="found 62 triangles"):
        read_mesh(path)
