"""Tensors come back as they were, in files that others may read as far as the umask allows."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
import safetensors.torch
import torch

from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError


@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_the_umask_decides_who_reads(tmp_path: Path, umask: int, mode: int) -> None:
    before = os.umask(umask)
    try:
        save_tensors(tmp_path / "a.safetensors", {"x": torch.ones(2)})
    finally:
        os.umask(before)
    assert (tmp_path / "a.safetensors").stat().st_mode & 0o777 == mode
    assert [path.name for path in tmp_path.iterdir()] == ["a.safetensors"]


def test_tensors_and_note_come_back(tmp_path: Path) -> None:
    tensors = {"x": torch.arange(6.0).reshape(2, 3).T, "i": torch.tensor([1, 2], dtype=torch.int32)}
    save_tensors(tmp_path / "a.safetensors", tensors, {"grid": 8})
    found, note = load_tensors(tmp_path / "a.safetensors")
    assert note == {"grid": 8}
    assert all(torch.equal(found[name], tensors[name]) and found[name].dtype == tensors[name].dtype for name in tensors)
    with pytest.raises(InputError, match=r"b\.safetensors"):
        load_tensors(tmp_path / "b.safetensors")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
def test_numbers_that_no_scene_has_are_refused(tmp_path: Path, value: float) -> None:
    save_tensors(tmp_path / "a.safetensors", {"x": torch.tensor([1.0, value]), "y": torch.ones(1)})
    with pytest.raises(InputError, match=r"a\.safetensors.*finite x"):
        load_tensors(tmp_path / "a.safetensors")


def test_types_that_no_scene_has_are_refused(tmp_path: Path) -> None:
    save_tensors(tmp_path / "a.safetensors", {"x": torch.ones(2).to(torch.float8_e4m3fn)})
    with pytest.raises(InputError, match=r"x of torch\.float8"):
        load_tensors(tmp_path / "a.safetensors")


@pytest.mark.parametrize("note", ["1", "null", "[", '{"a": 1, "a": 2}'])
def test_a_note_is_a_strict_json_object(tmp_path: Path, note: str) -> None:
    safetensors.torch.save_file({"x": torch.ones(1)}, tmp_path / "a.safetensors", metadata={"note": note})
    with pytest.raises(InputError, match=r"a\.safetensors"):
        load_tensors(tmp_path / "a.safetensors")


@pytest.mark.parametrize("shape", [[2**64, 1], [-1], [2**40, 2**40], ["x"], None])
def test_shapes_that_no_tensor_has_are_refused(tmp_path: Path, shape: object) -> None:
    header = json.dumps({"x": {"dtype": "F32", "shape": shape, "data_offsets": [0, 0]}}).encode()
    (tmp_path / "a.safetensors").write_bytes(len(header).to_bytes(8, "little") + header)
    with pytest.raises(InputError, match=r"a\.safetensors: expected a safetensors file"):
        load_tensors(tmp_path / "a.safetensors")


def test_a_shape_that_torch_cannot_hold_is_refused(tmp_path: Path) -> None:
    """Without entries its bytes are right, whatever its other sides."""
    header = json.dumps({"x": {"dtype": "F32", "shape": [0, 2**63], "data_offsets": [0, 0]}}).encode()
    (tmp_path / "a.safetensors").write_bytes(len(header).to_bytes(8, "little") + header)
    with pytest.raises(InputError, match=r"a\.safetensors"):
        load_tensors(tmp_path / "a.safetensors")
