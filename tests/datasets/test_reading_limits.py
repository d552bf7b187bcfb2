"""What a file may cost is a setting: of the readers in a block, and of a run."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import tifffile
import torch
from PIL import Image

import rgspipe as rg
import toys
from luminaire_files import ies
from mesh_files import cuboid_triangles, quarters, textured_square, write_coloured
from raycast import ROOM
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.display_image import read_levels
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.datasets.photometric_file import read_photometry
from rgspipe.datasets.ply.table import read_vertices, write_vertices
from rgspipe.datasets.radiance_image import read_hdr
from rgspipe.datasets.reading_limits import ReadingLimits, reading_limits, reading_within, timed
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.datasets.tiff_image import read_tiff
from rgspipe.graph.pipeline import run
from rgspipe.store.files import write_json

#: A Radiance picture of 2 × 4 pixels.
HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 2\n" + bytes(32)

COLOURS = np.full((24, 3), 99, np.uint8)

#: What writes a file of a kind, what reads it, and a limit that it is beyond.
KINDS: dict[str, tuple[Callable[[Path], object], Callable[[Path], object], dict[str, int]]] = {
    "a.png": (lambda path: Image.new("L", (8, 8)).save(path), read_levels, {"pixels": 63}),
    "a.json": (lambda path: write_json(path, {"a": "b" * 100}), lambda path: read_json(path, "a"), {"text_bytes": 100}),
    "a.ply": (lambda path: write_vertices(path, {"x": np.arange(9.0)}, []), read_vertices, {"vertices": 8}),
    "a.obj": (lambda path: textured_square(quarters()).export(path), read_mesh, {"bytes": 20}),
    "b.ply": (lambda path: write_coloured(path, *cuboid_triangles(ROOM), COLOURS), read_mesh, {"vertices": 11}),
    "a.ies": (lambda path: path.write_text(ies()), read_photometry, {"text_bytes": 100}),
    "a.hdr": (lambda path: path.write_bytes(HDR), read_hdr, {"pixels": 7}),
    "a.tif": (lambda path: tifffile.imwrite(path, np.zeros((4, 2), np.float32)), read_tiff, {"pixels": 7}),
    "a.safetensors": (lambda path: save_tensors(path, {"x": torch.zeros(99)}), load_tensors, {"bytes": 99}),
}


@pytest.mark.parametrize("name", KINDS)
def test_what_is_beyond_a_limit_is_refused_with_the_setting(tmp_path: Path, name: str) -> None:
    write, read, limits = KINDS[name]
    write(tmp_path / name)
    read(tmp_path / name)
    with reading_within(ReadingLimits(**limits)), pytest.raises(rg.InputError, match=rf"{name}.*limits\.\*"):
        read(tmp_path / name)
    read(tmp_path / name)


@timed
def _slow(path: Path) -> int:
    """What reads for two seconds if nothing stops it."""
    end = time.thread_time() + 2.0
    try:
        while time.thread_time() < end:
            pass
    except Exception:  # as some readers do
        return 0
    return len(path.name)


def test_a_reader_is_stopped_once_it_has_taken_too_long(tmp_path: Path) -> None:
    handler = signal.getsignal(signal.SIGVTALRM)
    begin = time.thread_time()
    with reading_within(ReadingLimits(seconds=0.05)), pytest.raises(rg.InputError, match=r"0\.05 s.*limits\.\*"):
        _slow(tmp_path / "a.txt")
    assert time.thread_time() - begin < 1.0  # measured: 0.05 s
    assert signal.getsignal(signal.SIGVTALRM) is handler and signal.getitimer(signal.ITIMER_VIRTUAL) == (0.0, 0.0)


def test_a_file_that_memory_does_not_hold_is_refused(tmp_path: Path) -> None:
    """A file of zeros takes no room on a disk, whatever its size."""

    def read(path: Path) -> bytes:
        raise MemoryError

    with pytest.raises(rg.InputError, match=r"a\.bin: expected a file that fits into memory"):
        timed(read)(tmp_path / "a.bin")


def test_in_another_thread_it_is_refused_when_it_is_back(tmp_path: Path) -> None:
    def read() -> int:
        with reading_within(ReadingLimits(seconds=1e-3)):
            return timed(lambda path: sum(range(10**6)))(tmp_path / "a.txt")

    with ThreadPoolExecutor(1) as pool, pytest.raises(rg.InputError, match=r"a\.txt.*0\.001 s"):
        pool.submit(read).result()


def test_a_run_reads_within_its_own_and_depends_on_none(tmp_path: Path) -> None:
    config = with_changes(RgspipeConfig(), {"stage": "grow", "outputs": str(tmp_path), "dataset.resolution": 8})
    for pixels in (7, 8):
        # The second run finds what the first has made.
        artifact = run(with_changes(config, {"limits.pixels": pixels}), toys.load)
        assert artifact.facts["pixels"] == 7 and reading_limits() == ReadingLimits()
