"""Our surfels in PLY files: they come back as they were, and what was edited in between is noticed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from plyfile import PlyData

from clouds import cloud
from rgspipe.datasets.ply.file import PlyOptions, save_ply
from rgspipe.datasets.ply.table import read_vertices
from rgspipe.errors import InputError
from rgspipe.renderer.ply import load_ply
from rgspipe.scene import NO_CLIP, Coverage, Gloss, Surfels

COUNT = 4


def numbers(*shape: int, low: float, high: float) -> st.SearchStrategy[np.ndarray]:
    return arrays.arrays(np.float32, shape, elements=st.floats(low, high, width=32))


@st.composite
def any_surfels(draw: st.DrawFn) -> Surfels:
    """Surfels of any size and place, with edges and gloss, or without."""
    turns = draw(numbers(COUNT, 4, low=-1, high=1)) + np.array([2.0, 0, 0, 0], np.float32)
    albedo = draw(numbers(COUNT, 3, low=0, high=0.5))
    low = draw(st.floats(0.0, 0.8))
    gloss = None
    if draw(st.booleans()):
        exponents = draw(numbers(COUNT, low=1, high=1e3))
        gloss = Gloss(torch.from_numpy(draw(numbers(COUNT, 3, low=0, high=0.5))), torch.from_numpy(exponents))
    parts = {
        "centers": draw(numbers(COUNT, 3, low=-(2.0**20), high=2.0**20)),
        "rotations": turns / np.linalg.norm(turns, axis=1, keepdims=True),
        "scales": draw(numbers(COUNT, 2, low=2.0**-30, high=2.0**30)),
        "opacities": draw(numbers(COUNT, low=0, high=1)),
        "albedo": albedo,
        "clip_offsets": draw(numbers(COUNT, 2, low=-1, high=NO_CLIP)),
        "clip_angles": draw(numbers(COUNT, 2, low=-4, high=4)),
        "guessed": draw(numbers(COUNT, low=0, high=2)),
    }
    coverage = Coverage(low, draw(st.floats(low + 1e-3, 1.0)), draw(st.floats(1e-6, 10.0)), draw(st.floats(1e-6, 1.0)))
    return Surfels(**{name: torch.from_numpy(x) for name, x in parts.items()}, coverage=coverage, gloss=gloss)


def assert_same(one: Surfels, two: Surfels) -> None:
    assert one.coverage == two.coverage
    for name, tensor in one.tensors().items():
        assert torch.equal(tensor, getattr(two, name)), name
    assert (one.gloss is None) == (two.gloss is None)
    if one.gloss is not None and two.gloss is not None:
        assert torch.equal(one.gloss.reflectance, two.gloss.reflectance)
        assert torch.equal(one.gloss.exponents, two.gloss.exponents)


@settings(max_examples=60, deadline=None)
@given(surfels=any_surfels())
def test_our_surfels_come_back_bit_for_bit(surfels: Surfels, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("ply") / "surfels.ply"
    save_ply(path, surfels)
    again, conversion = load_ply(path)
    assert_same(surfels, again)
    assert conversion.losses == () and "nothing was lost" in conversion.lines()[-1]


def test_colours_of_a_light_change_only_what_viewers_show(tmp_path: Path) -> None:
    surfels = cloud(50, 0).to(torch.float32)
    radiance = torch.rand(50, 3, generator=torch.Generator().manual_seed(0))
    plain, lit = tmp_path / "plain.ply", tmp_path / "lit.ply"
    save_ply(plain, surfels)
    written = save_ply(lit, surfels, radiance=radiance)
    assert_same(surfels, load_ply(lit)[0])
    one, two = (PlyData.read(str(path))["vertex"] for path in (plain, lit))
    assert not np.allclose(one["f_dc_0"], two["f_dc_0"])
    assert [loss.what for loss in written.losses if "white" in loss.what]


def test_the_viewer_layout_has_the_properties_of_3dgs_in_their_order(tmp_path: Path) -> None:
    surfels = cloud(50, 1).to(torch.float32)
    conversion = save_ply(tmp_path / "v.ply", surfels, layout="viewer")
    vertex = PlyData.read(str(tmp_path / "v.ply"))["vertex"]
    names = ["x", "y", "z", "nx", "ny", "nz", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(45))]
    names += ["opacity", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
    assert [item.name for item in vertex.properties] == names
    assert {item.val_dtype for item in vertex.properties} == {"f4"}
    np.testing.assert_allclose(vertex["scale_2"], np.log(1e-6), rtol=1e-6)
    np.testing.assert_allclose(1 / (1 + np.exp(-vertex["opacity"])), surfels.opacities, atol=1e-6)
    edges = next(loss for loss in conversion.losses if "edges" in loss.what)
    assert edges.surfels == int((surfels.clip_offsets < NO_CLIP).any(dim=1).sum())


def test_what_an_editor_changed_is_taken_over_and_reported(tmp_path: Path) -> None:
    surfels = cloud(20, 2).to(torch.float32)
    path = tmp_path / "s.ply"
    save_ply(path, surfels)
    content = PlyData.read(str(path), mmap=False)
    content["vertex"]["scale_0"][3] += 1.0
    content["vertex"]["opacity"][4] = 0.0
    content["vertex"]["f_dc_1"][5] = 0.0
    content.write(str(path))
    again, conversion = load_ply(path)
    expected = replace(surfels, scales=surfels.scales.clone(), opacities=surfels.opacities.clone())
    assert again.scales[3, 0] == pytest.approx(float(np.e * surfels.scales[3, 0]), rel=1e-6)
    assert again.opacities[4] == 0.5
    assert again.albedo[5, 1] == pytest.approx(0.2140, abs=1e-4), "sRGB 0.5"
    for name, row in (("scales", 3), ("opacities", 4), ("albedo", 5)):
        others = torch.arange(20) != row
        assert torch.equal(getattr(again, name)[others], getattr(expected, name)[others]), name
    assert [loss.surfels for loss in conversion.losses] == [1, 1, 1]


def test_a_file_of_ours_without_our_properties_is_read_as_gaussians(tmp_path: Path) -> None:
    surfels = cloud(60, 3).to(torch.float32)
    save_ply(tmp_path / "v.ply", surfels, layout="viewer")
    again, conversion = load_ply(tmp_path / "v.ply", PlyOptions(fronts="kept"))
    assert conversion.layout == "3DGS Gaussians"
    torch.testing.assert_close(again.centers, surfels.centers)
    # float32 logs and exponentials; measured 3e-7.
    torch.testing.assert_close(again.albedo, surfels.albedo, atol=1e-5, rtol=0)
    torch.testing.assert_close(again.normals, surfels.normals, atol=1e-5, rtol=0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b'"low": 0.2', b'"low": 7.0', "comment rgspipe-surfels"),
        (b'"low": 0.2', b'"low": "2"', "numbers of the coverage"),
        (b'"version": 1', b'"version": 2', "version 1"),
        (b'{"version"', b'["version"', "numbers of the coverage"),
    ],
)
def test_a_damaged_comment_is_refused(tmp_path: Path, old: bytes, new: bytes, words: str) -> None:
    path = tmp_path / "s.ply"
    save_ply(path, cloud(5, 0).to(torch.float32))
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))
    with pytest.raises(InputError, match=words):
        load_ply(path)


def test_radiance_of_another_scene_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"radiance: expected numbers of shape \(5, 3\)"):
        save_ply(tmp_path / "s.ply", cloud(5, 0), radiance=torch.zeros(4, 3))


@pytest.mark.filterwarnings("error")
def test_a_number_that_no_float_holds_is_refused_without_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "text.ply"
    path.write_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1e60\n")
    with pytest.raises(InputError, match="property x: expected finite numbers"):
        read_vertices(path).columns("x")
