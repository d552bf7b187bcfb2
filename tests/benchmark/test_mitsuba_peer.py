"""Mitsuba beside us: the same image and derivative in closed form, and a reason wherever it cannot run."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from rgspipe.benchmark import mitsuba_peer, mitsuba_process
from rgspipe.benchmark.mitsuba_peer import mitsuba_rows
from rgspipe.benchmark.mitsuba_process import PeerMissing, ask_mitsuba, find_llvm
from rgspipe.benchmark.truth import Truth
from tabletop import TABLETOP, lit_tabletop

SIZE = 16


def _truth() -> Truth:
    """Of the tabletop, in closed form."""
    image = torch.stack([torch.stack([lit_tabletop(k, light, SIZE) for light in (0, 1)]) for k in (0, 1)]).float()
    return Truth("tabletop", SIZE, 0, {"global": image}, {"global": torch.zeros_like(image)})


def _why_missing() -> str:
    try:
        mitsuba_process.mitsuba_version()
        find_llvm()
    except PeerMissing as missing:
        return str(missing)
    return ""


needs_mitsuba = pytest.mark.skipif(bool(_why_missing()), reason=_why_missing() or "nothing is missing")


@pytest.mark.slow
@needs_mitsuba
def test_its_images_are_the_closed_form_and_converge_to_it() -> None:
    away = [torch.ones(SIZE, SIZE, dtype=torch.bool)] * 2
    table = mitsuba_rows(TABLETOP, _truth(), 2, away=away, samples=(4, 256), gradient_samples=(4,))
    few, many = table.to_dict("records")
    # Measured 51.1 dB with 256 samples, in the worst of four images; the wrong way round they have 22 dB.
    assert many["global_db_worst"] > 45.0 and many["global_db"] > few["global_db"] + 10.0
    assert many["global_relative"] < 0.02 < few["global_relative"]
    assert many["global_db_off_edges"] == pytest.approx(many["global_db"])
    assert (table[["forward_ms", "first_ms"]] > 0).all(axis=None)
    assert few["step_ms"] > 0 and np.isnan(many["step_ms"])
    assert "threads" in many["note"] and many["renderer"].startswith("Mitsuba 3.")


@pytest.mark.slow
@needs_mitsuba
def test_its_gradient_is_the_closed_form_s() -> None:
    target = 0.9 * lit_tabletop(0, 0, SIZE)
    arrays = {
        "corners": TABLETOP.surfaces.corners.numpy(),
        "albedo": TABLETOP.surfaces.albedo.numpy(),
        "poses": np.stack([camera.camera_to_world.numpy() for camera in TABLETOP.cameras(SIZE)]),
        "lights": TABLETOP.lights.double().numpy(),
        "target": target.float().numpy(),
    }
    figures, images = ask_mitsuba(
        "render", arrays, field_of_view=TABLETOP.field_of_view, resolution=SIZE, max_depth=4, samples=[],
        gradient_samples=[1024], repetitions=2,
    )  # fmt: skip
    step = 1e-4 * torch.eye(3, dtype=torch.float64)
    losses = [[(lit_tabletop(0, 0, SIZE, s * d) - target).square().mean() for s in (1, -1)] for d in step]
    expected = np.array([float((ahead - behind) / 2e-4) for ahead, behind in losses])
    # Measured 0.4 % of its length, the noise of 1024 samples.
    assert np.linalg.norm(np.array(figures["gradient"]) - expected) < 0.02 * np.linalg.norm(expected)
    assert images == {}


def _notes() -> list[str]:
    table = mitsuba_rows(TABLETOP, _truth(), 2, samples=(4, 16))
    assert list(table["spp"]) == [4, 16] and table["global_db"].isna().all() and table["forward_ms"].isna().all()
    return list(table["note"])


def test_without_mitsuba_the_rows_say_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert all("pip install 'rgspipe[bench]'" in note for note in _notes())


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if Mitsuba were installed."""
    for module in (mitsuba_process, mitsuba_peer):
        monkeypatch.setattr(module, "mitsuba_version", lambda: "0.0.0")
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)


def test_without_llvm_the_rows_say_how_to_get_it(
    installed: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "libLLVM-15.so.1").touch()
    (tmp_path / "libLLVM.txt").touch()
    monkeypatch.setattr(mitsuba_process, "LIBRARY_FOLDERS", (str(tmp_path),))
    with pytest.raises(PeerMissing, match=r"no LLVM library of version 16 or later.*libllvm19"):
        find_llvm()
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "none.so"))
    with pytest.raises(PeerMissing, match=r"DRJIT_LIBLLVM_PATH names no file: .*none\.so"):
        find_llvm()


def test_the_newest_llvm_is_taken(installed: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("libLLVM-14.0.6.so.1", "libLLVM-9.so", "x/libLLVM.so.19.1", "libLLVM-18.so.1", "libLLVM.so"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.setattr(mitsuba_process, "LIBRARY_FOLDERS", (str(tmp_path),))
    assert find_llvm() == str(tmp_path / "x/libLLVM.so.19.1")


def test_a_crash_of_its_process_becomes_a_note(
    installed: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    script, library = tmp_path / "python.sh", tmp_path / "libLLVM-19.so"
    script.write_text("#!/bin/sh\necho illegal instruction\nkill -SEGV $$\n")
    script.chmod(0o755)
    library.touch()
    monkeypatch.setattr(sys, "executable", str(script))
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(library))
    assert all("killed by signal 11" in note and "illegal instruction" in note for note in _notes())
