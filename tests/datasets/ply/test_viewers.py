"""What public loaders of Gaussians demand of a PLY file by their sources (docs/laboratory/ply.md), and ours."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import torch
from plyfile import PlyData

from clouds import cloud
from rgspipe.datasets.ply.file import PlyOptions, save_ply
from rgspipe.errors import InputError
from rgspipe.names import SurfelLayout
from rgspipe.renderer.ply import load_ply
from rgspipe.scene import Surfels
from rooms import closed_box

LAYOUTS: tuple[SurfelLayout, ...] = get_args(SurfelLayout)

#: What SuperSplat refuses a file without.
NEEDED = ["x", "y", "z", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
NEEDED += [*(f"f_dc_{i}" for i in range(3)), "opacity"]

#: The constant harmonic as loaders write it.
SH_C0 = 0.28209479177387814


@dataclass(frozen=True)
class File:
    """A PLY file as loaders see it: header lines without their line feeds, and float32 columns by name."""

    header: list[str]
    bytes_of_header: int
    columns: dict[str, np.ndarray]


@pytest.fixture(scope="module")
def surfels() -> Surfels:
    return cloud(40, 5).to(torch.float32)


@pytest.fixture(scope="module", params=LAYOUTS)
def written(request: pytest.FixtureRequest, surfels: Surfels, tmp_path_factory: pytest.TempPathFactory) -> File:
    path = tmp_path_factory.mktemp("viewers") / "surfels.ply"
    save_ply(path, surfels, layout=request.param)
    content = path.read_bytes()
    length = content.index(b"\nend_header\n") + len(b"\nend_header\n")
    header = content[:length].decode("ascii").split("\n")[:-1]
    names = [line.split(" ")[2] for line in header if line.startswith("property ")]
    rows = np.frombuffer(content[length:], "<f4").reshape(-1, len(names))
    return File(header, length, dict(zip(names, rows.T, strict=True)))


def test_the_header_has_only_the_words_that_the_strictest_loader_knows(written: File) -> None:
    # The PlayCanvas engine: first bytes "ply\n", single spaces, comments at the start of a line, no obj_info or list.
    assert written.header[0] == "ply" and written.header[-1] == "end_header"
    assert written.header[1] == "format binary_little_endian 1.0"
    body = [line for line in written.header[2:-1] if not line.startswith("comment ")]
    assert body[0] == "element vertex 40"
    assert all(re.fullmatch(r"property float \w+", line) for line in body[1:])


def test_the_header_is_short_and_plain_enough_for_loaders_that_search_it(written: File) -> None:
    # antimatter15/splat looks for its end in the first 10 KiB; GaussianSplats3D counts characters as bytes, takes
    # "packed_" anywhere for PlayCanvas's layout, and "f_rest_" or "end_header" in a comment for the thing itself.
    assert written.bytes_of_header < 10 * 1024
    comments = " ".join(line for line in written.header if line.startswith("comment "))
    assert not re.search("packed_|f_rest_|end_header|element", comments)
    assert sum(line == "end_header" for line in written.header) == 1
    assert "packed_" not in " ".join(written.columns)


def test_harmonics_are_none_or_all_of_a_degree(written: File) -> None:
    rest = [name for name in written.columns if name.startswith("f_rest")]
    assert len(rest) in (0, 9, 24, 45)
    assert rest == [f"f_rest_{index}" for index in range(len(rest))]


def test_every_loader_finds_its_properties_and_decodes_our_surfels(written: File, surfels: Surfels) -> None:
    assert not set(NEEDED) - set(written.columns)
    values = {name: written.columns[name].astype(np.float64) for name in NEEDED}
    assert all(np.isfinite(column).all() for column in values.values())
    opacity = 1.0 / (1.0 + np.exp(-values["opacity"]))
    np.testing.assert_allclose(opacity, surfels.opacities, atol=1e-7)  # measured 9e-9
    scales = np.exp(np.stack([values[f"scale_{i}"] for i in range(3)], axis=1))
    np.testing.assert_allclose(scales[:, :2], surfels.scales, rtol=1e-6)  # float32 logarithms, measured 1.2e-7
    assert scales[:, 2] == pytest.approx(1e-6, rel=1e-5)
    colour = 0.5 + SH_C0 * np.stack([values[f"f_dc_{i}"] for i in range(3)], axis=1)
    assert colour.min() >= 0.0 and colour.max() <= 1.0 + 1e-6
    # w first: the third column of the usual matrix is the normal.
    quaternions = np.stack([values[f"rot_{i}"] for i in range(4)], axis=1)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-6)
    w, x, y, z = quaternions.T
    third = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    np.testing.assert_allclose(third, surfels.normals, atol=2e-6)  # measured 2.6e-7


def test_a_file_that_another_program_wrote_again_keeps_edges_and_exact_values(tmp_path: Path) -> None:
    # splat-transform keeps properties that it does not know, and drops comments.
    room = closed_box(0.25).to(torch.float32)
    room = replace(room, clip_offsets=torch.linspace(0.0, 0.1, 2 * len(room)).reshape(-1, 2))
    save_ply(tmp_path / "s.ply", room)
    content = PlyData.read(str(tmp_path / "s.ply"), mmap=False)
    content.comments = []
    content.write(str(tmp_path / "s.ply"))
    again, conversion = load_ply(tmp_path / "s.ply", PlyOptions(low=0.3, high=0.8))
    for name, tensor in room.tensors().items():
        assert torch.equal(tensor, getattr(again, name)), name
    assert (again.coverage.low, again.coverage.high) == (0.3, 0.8)
    assert again.coverage.layer_thickness == pytest.approx(room.coverage.layer_thickness, rel=1e-6)
    assert any("comment rgspipe-surfels is gone" in note for note in conversion.notes)


def test_the_compressed_layout_is_named_with_the_way_out(tmp_path: Path) -> None:
    names = ["packed_position", "packed_rotation", "packed_scale", "packed_color"]
    lines = ["ply", "format ascii 1.0", "element vertex 1", *(f"property uint {name}" for name in names)]
    (tmp_path / "c.ply").write_text("\n".join([*lines, "end_header", "1 2 3 4", ""]))
    with pytest.raises(InputError, match=r"compressed layout of PlayCanvas.*splat-transform"):
        load_ply(tmp_path / "c.ply")
