"""Photographs that a capture lists and that are not there: refused at once and by name, or left out."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from readable_captures import SCANNED
from rgspipe.datasets.scans.layouts import read_scan
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.errors import InputError
from scan_layouts import photographed, write_colmap, write_nerfstudio

LEAVE_OUT = ScanOptions(missing="leave_out")


def masked(root: Path) -> None:
    path = root / "transforms.json"
    content = json.loads(path.read_text())
    content["frames"][0]["mask_path"] = "mask.png"
    path.write_text(json.dumps(content))


@pytest.mark.parametrize("what", ["images/2.exr", "depth/2.exr"])
def test_a_file_that_is_missing_is_named_with_what_to_do(tmp_path: Path, what: str) -> None:
    """The error was to check the path; frames had to be taken out by hand, of COLMAP's binary files by a program."""
    write_nerfstudio(tmp_path, photographed(5, 8))
    (tmp_path / what).unlink()
    with pytest.raises(
        InputError, match=rf"transforms\.json.*{what}: no such file \(1 of 5 .*Copy.*missing='leave_out'"
    ):
        read_scan(tmp_path, ScanOptions())
    scan = read_scan(tmp_path, LEAVE_OUT)
    assert [frame.image.stem for frame in scan.frames] == ["0", "1", "3", "4"]
    [note] = scan.notes
    assert note.startswith("1 photograph is left out, of which a file is missing: ") and note.endswith(what)


def test_all_that_is_missing_is_told_at_once(tmp_path: Path) -> None:
    write_colmap(tmp_path, photographed(8, 8), binary=True)
    images = sorted((tmp_path / "images").iterdir())
    for path in images[:5]:
        path.unlink()
    with pytest.raises(InputError, match=rf"{images[0].name}, .*{images[2].name}, …: no such file \(5 of 8 .*Copy"):
        read_scan(tmp_path, ScanOptions())
    scan = read_scan(tmp_path, LEAVE_OUT)
    assert len(scan.frames) == 3 and "5 photographs are left out" in scan.notes[-1]


def test_a_mask_that_is_missing_does_not_make_all_of_its_photograph_count(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path, SCANNED)
    masked(tmp_path)
    with pytest.raises(InputError, match=r"mask\.png: no such file \(1 of 2"):
        read_scan(tmp_path, ScanOptions())
    assert len(read_scan(tmp_path, LEAVE_OUT).frames) == 1


def test_photographs_that_are_not_taken_may_be_missing(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path, photographed(5, 8))
    (tmp_path / "images/1.exr").unlink()
    assert [frame.image.stem for frame in read_scan(tmp_path, ScanOptions(frames=3)).frames] == ["0", "2", "4"]
    # What is left is spread anew.
    scan = read_scan(tmp_path, ScanOptions(frames=4, missing="leave_out"))
    assert [frame.image.stem for frame in scan.frames] == ["0", "2", "3", "4"]


def test_a_capture_of_which_nothing_is_there_is_refused(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path, SCANNED)
    for path in (tmp_path / "images").iterdir():
        path.unlink()
    with pytest.raises(InputError, match=r"expected photographs whose files are there, found .*all 2 photographs"):
        read_scan(tmp_path, LEAVE_OUT)
