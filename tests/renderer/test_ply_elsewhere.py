"""PLY files of 3DGS, 2DGS and RadiosityGS as surfels, with what is lost; and broken ones refused by name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from plyfile import PlyData

from ply_files import gaussian_columns, radiosity_columns, write_ply
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.opacity_profile import fit_profiles, smoothstep
from rgspipe.datasets.ply.file import PlyOptions
from rgspipe.datasets.ply.radiosity import profile
from rgspipe.errors import InputError
from rgspipe.renderer.ply import load_ply
from rgspipe.scene import Camera, look_at
from rgspipe.scene.surfels import quaternion_to_axes

KEPT = PlyOptions(fronts="kept", gloss=True)


def lost(conversion, words: str):
    return next(loss for loss in conversion.losses if words in loss.what)


def test_flat_gaussians_lose_only_the_profile(tmp_path: Path) -> None:
    surfels, conversion = load_ply(write_ply(tmp_path / "g.ply", gaussian_columns()), KEPT)
    assert conversion.layout == "3DGS Gaussians" and len(surfels) == 36
    torch.testing.assert_close(surfels.normals, torch.tensor([[0.0, 0.0, 1.0]]).expand(36, 3))
    # sRGB ½ is linear 0.214.
    torch.testing.assert_close(surfels.albedo, torch.full((36, 3), 0.2140), atol=1e-4, rtol=0)
    torch.testing.assert_close(surfels.scales, torch.tensor([[0.05, 0.04]]).expand(36, 2))
    assert [loss.what[:15] for loss in conversion.losses] == ["layers are shar"]
    linear = load_ply(tmp_path / "g.ply", PlyOptions(fronts="kept", srgb=False))[0]
    torch.testing.assert_close(linear.albedo, torch.full((36, 3), 0.5))


def test_the_covered_share_of_a_gaussian_stays_within_what_is_reported(tmp_path: Path) -> None:
    surfels, conversion = load_ply(write_ply(tmp_path / "g.ply", gaussian_columns(opacity=0.7)), KEPT)
    alpha = float(surfels.opacities[0]) * np.exp(-0.5 * np.linspace(0.0, 3.0, 500) ** 2)
    error = np.abs(smoothstep(surfels.coverage.low, surfels.coverage.high, alpha) - alpha).max()
    assert error == pytest.approx(lost(conversion, "sharpened").largest, abs=0.005)


@settings(max_examples=40, deadline=None)
@given(
    turn=st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(x * x for x in q) > 0.01),
    sizes=st.permutations([0.05, 0.03, 0.001]),
)
def test_the_thinnest_axis_becomes_the_normal(turn, sizes, tmp_path_factory: pytest.TempPathFactory) -> None:
    columns = gaussian_columns(tuple(sizes))
    columns |= {f"rot_{index}": 0 * columns["x"] + value for index, value in enumerate(turn)}
    path = write_ply(tmp_path_factory.mktemp("p") / "g.ply", columns)
    surfels, _ = load_ply(path, KEPT)
    axes = quaternion_to_axes(torch.tensor([turn], dtype=torch.float64))[0].float()
    order = sorted(range(3), key=lambda axis: sizes[axis])
    frame = surfels.frames[0]
    # Signs may differ; measured 3e-7.
    for ours, theirs in ((frame[2], axes[order[0]]), (frame[int(surfels.scales[0].argmax())], axes[order[2]])):
        assert float((ours * theirs).sum().abs()) == pytest.approx(1.0, abs=1e-5)
    assert float(torch.linalg.det(frame)) == pytest.approx(1.0, abs=1e-5)


def test_thickness_colour_and_view_dependence_that_are_lost_are_counted(tmp_path: Path) -> None:
    columns = gaussian_columns((0.05, 0.04, 0.02))
    columns["f_dc_0"] = columns["f_dc_0"] + np.where(np.arange(36) < 4, 3.0, 0.0)
    columns["f_rest_7"] = np.where(np.arange(36) < 9, 1.0, 0.0)
    surfels, conversion = load_ply(write_ply(tmp_path / "g.ply", columns), KEPT)
    assert lost(conversion, "thickness").surfels == 36
    assert lost(conversion, "thickness").largest == pytest.approx(0.5, rel=1e-5)
    assert lost(conversion, "0 to 1").surfels == 4 and float(surfels.albedo.max()) == 1.0
    assert lost(conversion, "view-dependent").surfels == 9
    assert lost(conversion, "view-dependent").largest == pytest.approx((1 / (12 * np.pi)) ** 0.5, rel=1e-5)


def test_faint_ones_and_those_outside_of_the_box_are_left_out(tmp_path: Path) -> None:
    columns = gaussian_columns()
    columns["opacity"] = np.where(np.arange(36) < 3, -8.0, columns["opacity"])
    path = write_ply(tmp_path / "g.ply", columns)
    surfels, conversion = load_ply(path, PlyOptions(fronts="kept", crop=(-1, 0.05, -1, 1, 1, 1)))
    assert len(surfels) == 30, "the lowest row of six, in which the faint ones are"
    assert lost(conversion, "left out").surfels == 6
    with pytest.raises(InputError, match="crop"):
        load_ply(path, PlyOptions(fronts="kept", crop=(5, 5, 5, 6, 6, 6)))


def test_fronts_look_where_they_are_told_to(tmp_path: Path) -> None:
    columns = gaussian_columns()
    columns["z"] = np.where(np.arange(36) < 18, 1.0, -1.0)
    path = write_ply(tmp_path / "g.ply", columns)
    up = torch.sign(load_ply(path, PlyOptions(fronts="outwards"))[0].normals[:, 2])
    assert torch.equal(up, torch.cat([torch.ones(18), -torch.ones(18)]))
    assert torch.equal(torch.sign(load_ply(path, PlyOptions(fronts="inwards"))[0].normals[:, 2]), -up)
    with pytest.raises(InputError, match=r"PlyOptions\(fronts='auto'\).*cameras\.json"):
        load_ply(path)
    (tmp_path / "cameras.json").write_text(json.dumps([{"position": [0.2, 0.2, 5.0]}]))
    surfels, conversion = load_ply(path)
    assert bool((surfels.normals[:, 2] > 0).all())
    assert any("cameras.json" in note for note in conversion.notes)
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.2, 0.2, -5.0]), torch.zeros(3)), 0.7, 128, 128)
    write_transforms(tmp_path / "transforms.json", [frame_entry("view", camera)])
    surfels, _ = load_ply(path, PlyOptions(cameras=tmp_path / "transforms.json"))
    assert bool((surfels.normals[:, 2] < 0).all())
    (tmp_path / "cameras.json").write_text(json.dumps([{"id": 3}]))
    with pytest.raises(InputError, match="position"):
        load_ply(path)


def test_text_and_big_endian_files_are_read(tmp_path: Path) -> None:
    binary = load_ply(write_ply(tmp_path / "b.ply", gaussian_columns()), KEPT)[0]
    text = load_ply(write_ply(tmp_path / "t.ply", gaussian_columns(), text=True), KEPT)[0]
    swapped = PlyData.read(str(tmp_path / "b.ply"))
    swapped.byte_order = ">"
    swapped.write(str(tmp_path / "s.ply"))
    assert b"binary_big_endian" in (tmp_path / "s.ply").read_bytes()[:40]
    for other in (text, load_ply(tmp_path / "s.ply", KEPT)[0]):
        assert torch.equal(binary.scales, other.scales) and torch.equal(binary.centers, other.centers)


def test_radiosity_surfels_are_decoded(tmp_path: Path) -> None:
    surfels, conversion = load_ply(write_ply(tmp_path / "r.ply", radiosity_columns()), KEPT)
    assert conversion.layout == "RadiosityGS surfels" and surfels.gloss is not None
    # Half of each range: albedo ½ · blending ½, shininess ½ · 40, geovalue ½ · 5.
    torch.testing.assert_close(surfels.albedo, torch.full((36, 3), 0.25))
    torch.testing.assert_close(surfels.gloss.exponents, torch.full((36,), 20.0))
    torch.testing.assert_close(surfels.gloss.reflectance, torch.full((36, 3), 0.25 * 21 / 22))
    r = np.linspace(0.0, 3.0, 40)
    stretch = surfels.scales[0, 0].item() / 0.025
    ours = smoothstep(0.2, 0.9, surfels.opacities[0].item() * np.exp(-0.5 * (r / stretch) ** 2))
    np.testing.assert_allclose(ours, profile(2.5, r), atol=0.026)  # measured 0.024
    assert any("no lights" in note for note in conversion.notes)
    assert any("sh_degree 9" in note for note in conversion.notes)


def test_ranges_come_from_the_models_configuration_without_running_it(tmp_path: Path) -> None:
    folder = tmp_path / "model" / "point_cloud" / "iteration_30000"
    folder.mkdir(parents=True)
    path = write_ply(folder / "point_cloud.ply", radiosity_columns())
    config = tmp_path / "model" / "cfg_args"
    config.write_text("Namespace(sh_degree=4, max_scaling=0.2, geovalue_mul=4.0, source_path='x', data_device='cuda')")
    surfels, conversion = load_ply(path, KEPT)
    assert surfels.gloss is not None
    torch.testing.assert_close(surfels.gloss.exponents, torch.full((36,), 5.0))
    assert any(str(config) in note for note in conversion.notes)
    for text in (
        "Namespace(sh_degree=open('x'))",
        "Namespace(sh_degree='four')",
        "1 +",
        "Namespace(max_scaling=-1)",
        "Namespace(max_scaling=0.1, max_scaling=0.2)",
        "Namespace(**{'max_scaling': 0.1})",
        "dict(max_scaling=0.1)",
    ):
        config.write_text(text)
        with pytest.raises(InputError, match="cfg_args"):
            load_ply(path, KEPT)


def test_strong_radiosity_profiles_are_fitted_within_what_is_stated() -> None:
    geovalues = np.linspace(2.0, 5.0, 13)
    fitted = fit_profiles(profile, geovalues, 0.2, 0.9)
    assert fitted.rms.max() < 0.02 and fitted.largest.max() < 0.045  # measured 0.0193 and 0.0416


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda c: c.pop("opacity"), "element vertex, property opacity"),
        (lambda c: c.pop("rot_3"), "element vertex, property rot_3"),
        (lambda c: c.pop("x"), "element vertex, property x"),
        (lambda c: c.pop("scale_1"), "property scale_1"),
        (lambda c: c.update(f_dc_1=c["f_dc_1"] + np.nan), "property f_dc_1.*36 values"),
        (lambda c: c.update(scale_0=c["scale_0"] + 800.0), "property scale_0"),
        (lambda c: c.update(rot_0=c["rot_0"] - 1.0), "property rot_0.*0, 0, 0, 0"),
        (lambda c: c.update(x=0 * c["x"], y=0 * c["y"]), "lie on surfaces"),
    ],
)
def test_gaussians_with_impossible_values_are_refused_by_property(tmp_path: Path, spoil, words: str) -> None:
    columns = gaussian_columns()
    spoil(columns)
    with pytest.raises(InputError, match=words):
        load_ply(write_ply(tmp_path / "g.ply", columns), KEPT)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "whole PLY"),
        (b"solid cube\n", "whole PLY"),
        (b"ply\nformat ascii 2.0\nend_header\n", "whole PLY"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n", "whole PLY"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\nabc\n", "row 0: property 'x'"),
        (b"ply\nformat ascii 1.0\nelement vertex -4\nproperty float x\nend_header\n", r"g\.ply"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 99\nproperty float x\nend_header\n\0\0", "99 rows"),
        (b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n", "at least one vertex"),
        (b"ply\nformat ascii 1.0\nelement face 1\nproperty float x\nend_header\n1\n", r"face \(1\)"),
        (b"ply\nformat ascii 1.0\nelement vertex 999999999999999\nproperty float x\nend_header\n1\n", r"g\.ply"),
        (
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float x\nend_header\n1 1\n",
            "property x.*a list",
        ),
        (b"\xff\xfe\x00ply", "whole PLY"),
    ],
    ids=range(12),
)
def test_malformed_files_are_refused(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "g.ply"
    path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        load_ply(path, KEPT)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone\.ply.*no such file"):
        load_ply(tmp_path / "gone.ply")
