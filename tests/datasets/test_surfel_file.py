"""Surfel files come back as they were written, and broken ones are refused by name."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest
import torch

from rgspipe.datasets.surfel_file import FORMAT, VERSION, load_surfels, save_surfels
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.scene import NO_CLIP, Coverage, Gloss, Surfels


@pytest.fixture
def surfels() -> Surfels:
    generator = torch.Generator().manual_seed(0)
    count = 7
    return Surfels(
        centers=torch.randn(count, 3, generator=generator),
        rotations=torch.nn.functional.normalize(torch.randn(count, 4, generator=generator), dim=1),
        scales=torch.rand(count, 2, generator=generator),
        opacities=torch.rand(count, generator=generator),
        albedo=torch.rand(count, 3, generator=generator),
        clip_offsets=torch.full((count, 2), NO_CLIP),
        clip_angles=torch.rand(count, 2, generator=generator),
        coverage=Coverage(0.5, 0.9, 0.0123456789, 1e-3),
    )


def note_of(surfels: Surfels) -> dict:
    return {"format": FORMAT, "version": VERSION, "coverage": asdict(surfels.coverage)}


def test_surfels_come_back_exactly(tmp_path, surfels):
    save_surfels(tmp_path / "new" / "surfels.safetensors", surfels)
    again = load_surfels(tmp_path / "new" / "surfels.safetensors")
    assert again.coverage == surfels.coverage
    for name, tensor in surfels.tensors().items():
        assert torch.equal(tensor, getattr(again, name)), name
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["surfels.safetensors"]


def test_gloss_is_stored_where_there_is_any(tmp_path, surfels):
    save_surfels(tmp_path / "diffuse.safetensors", surfels)
    gloss = Gloss(torch.linspace(0.0, 0.3, 21).reshape(7, 3), torch.linspace(1.0, 50.0, 7))
    save_surfels(tmp_path / "glossy.safetensors", replace(surfels, albedo=0.5 * surfels.albedo, gloss=gloss))
    assert not any("gloss" in name for name in load_tensors(tmp_path / "diffuse.safetensors")[0])
    assert load_surfels(tmp_path / "diffuse.safetensors").gloss is None
    again = load_surfels(tmp_path / "glossy.safetensors").gloss
    assert torch.equal(again.reflectance, gloss.reflectance)
    assert torch.equal(again.exponents, gloss.exponents)


@pytest.mark.parametrize(
    ("gloss", "message"),
    [
        ({"gloss.reflectance": torch.zeros(7, 3)}, "the tensors"),
        ({"gloss.reflectance": torch.zeros(7, 3), "gloss.exponents": torch.ones(6)}, "exponents must have shape"),
        ({"gloss.reflectance": torch.ones(7, 3), "gloss.exponents": torch.ones(7)}, "must be at most 1"),
    ],
)
def test_wrong_gloss_is_refused(tmp_path, surfels, gloss, message):
    save_tensors(tmp_path / "s.safetensors", surfels.tensors() | gloss, note_of(surfels))
    with pytest.raises(InputError, match=message):
        load_surfels(tmp_path / "s.safetensors")


def test_missing_and_truncated_files_are_named(tmp_path, surfels):
    path = tmp_path / "surfels.safetensors"
    with pytest.raises(InputError, match=r"surfels\.safetensors.*no such file"):
        load_surfels(path)
    save_surfels(path, surfels)
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(InputError, match=r"surfels\.safetensors"):
        load_surfels(path)
    path.write_bytes(b"not a tensor file")
    with pytest.raises(InputError, match=r"surfels\.safetensors"):
        load_surfels(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tensors: tensors.pop("scales"), "the tensors"),
        (lambda tensors: tensors.update(scales=torch.ones(3, 2)), r"scales: expected numbers of shape \(7, 2\)"),
        (lambda tensors: tensors.update(scales=torch.full((7, 2), torch.nan)), "finite scales"),
        (lambda tensors: tensors.update(scales=torch.ones(7, 2, dtype=torch.int64)), "one type"),
    ],
)
def test_wrong_tensors_are_refused(tmp_path, surfels, change, message):
    tensors = surfels.tensors()
    change(tensors)
    save_tensors(tmp_path / "s.safetensors", tensors, note_of(surfels))
    with pytest.raises(InputError, match=message):
        load_surfels(tmp_path / "s.safetensors")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "other"}, "format 'other'"),
        ({"version": 2}, "version 2"),
        ({"coverage": {"low": 0.5}}, "layer_thickness"),
        ({"coverage": None}, "coverage with the numbers"),
    ],
)
def test_wrong_notes_are_refused(tmp_path, surfels, change, message):
    save_tensors(tmp_path / "s.safetensors", surfels.tensors(), {**note_of(surfels), **change})
    with pytest.raises(InputError, match=message):
        load_surfels(tmp_path / "s.safetensors")


def test_files_from_before_surfels_were_guessed_are_read(tmp_path, surfels):
    old = {name: tensor for name, tensor in surfels.tensors().items() if name != "guessed"}
    save_tensors(tmp_path / "s.safetensors", old, note_of(surfels))
    assert not bool(load_surfels(tmp_path / "s.safetensors").guessed.any())


def test_a_file_of_no_surfels_is_refused(tmp_path, surfels):
    """In a frozen scene it was read, and an IndexError came of it in the first search."""
    none = Surfels(**{name: tensor[:0] for name, tensor in surfels.tensors().items()}, coverage=surfels.coverage)
    save_surfels(tmp_path / "a.safetensors", none)
    with pytest.raises(InputError, match=r"a\.safetensors: expected surfels, found none"):
        load_surfels(tmp_path / "a.safetensors")
