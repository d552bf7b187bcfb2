"""A PLY file is believed only as far as its size goes, and its surfels only as far as a scene can."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from ply_files import gaussian_columns, write_ply
from rgspipe.datasets.ply.file import read_ply
from rgspipe.datasets.ply.options import PlyOptions
from rgspipe.datasets.ply.table import read_vertices
from rgspipe.errors import InputError


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize(
    ("declared", "words"),
    [
        ("element vertex 1000000000\nproperty float x\n", "found 1000000000"),
        ("element vertex 1000000000\n", "found 1000000000"),
        ("element vertex 1\nproperty list uint float x\n", "found a list"),
        ("element face 3\nproperty list int int i\nelement vertex 1\nproperty float x\n", "found a list"),
    ],
)
def test_a_small_file_that_claims_much_is_refused_at_once(tmp_path: Path, form: str, declared: str, words: str) -> None:
    body = b"1000000000 1\n" if form == "ascii" else (10**9).to_bytes(4, "little") + b"\0" * 8
    (tmp_path / "a.ply").write_bytes(f"ply\nformat {form} 1.0\n{declared}end_header\n".encode() + body)
    begin = time.perf_counter()
    with pytest.raises(InputError, match=rf"a\.ply.*{words}"):
        read_vertices(tmp_path / "a.ply")
    assert time.perf_counter() - begin < 5.0  # measured: 1 ms; a list of 1e9 took minutes


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [("x", 1e15, "centers from"), ("scale_0", 60.0, "scales from"), ("scale_1", 79.0, "scales from")],
)
def test_gaussians_that_no_scene_has_are_refused(tmp_path: Path, name: str, value: float, words: str) -> None:
    columns = gaussian_columns()
    columns[name] = np.array(columns[name])
    columns[name][5] = value
    with pytest.raises(InputError, match=rf"a\.ply.*{words}"):
        read_ply(write_ply(tmp_path / "a.ply", columns), PlyOptions())
