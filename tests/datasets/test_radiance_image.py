"""What the header of a Radiance picture says of its pixels."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.datasets.radiance_image import read_hdr
from rgspipe.errors import InputError


def written(path: Path, *lines: str, kind: str = "FORMAT=32-bit_rle_rgbe", pixels: bytes = bytes([128] * 4)) -> Path:
    """A picture of one pixel, (128.5 / 256) in all colours as it is stored."""
    header = "\n".join(["#?RADIANCE", *lines, kind])
    path.write_bytes(header.encode() + b"\n\n-Y 1 +X 1\n" + pixels)
    return path


@pytest.mark.parametrize(
    ("lines", "factor"),
    [((), 1.0), (("EXPOSURE=4",), 4.0), (("EXPOSURE= 0.5", "EXPOSURE=8.0"), 4.0), (("PIXASPECT=1.0",), 1.0)],
)
def test_light_is_what_it_was_before_it_was_exposed(tmp_path: Path, lines: tuple[str, ...], factor: float) -> None:
    assert read_hdr(written(tmp_path / "a.hdr", *lines)) == pytest.approx(128.5 / 256.0 / factor, rel=1e-6)


@pytest.mark.parametrize(
    "line", ["EXPOSURE=nan", "EXPOSURE=0", "EXPOSURE=1e300", "EXPOSURE=x", "PIXASPECT=2", "COLORCORR=1 0.9 1"]
)
def test_what_would_be_read_wrongly_is_refused(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match=rf"a\.hdr: .*found {line}\. Convert"):
        read_hdr(written(tmp_path / "a.hdr", line))


@pytest.mark.parametrize("lines", [(), ("# was 32-bit_rle_rgbe",), ("FORMAT=32-bit_rle_rgbe",)])
def test_other_primaries_are_refused_whatever_else_the_header_mentions(tmp_path: Path, lines: tuple[str, ...]) -> None:
    """XYZ was read as red, green and blue where the other format's name stood in a comment."""
    with pytest.raises(InputError, match=r"a\.hdr: .*found FORMAT=.*32-bit_rle_xyze\. Convert it to EXR"):
        read_hdr(written(tmp_path / "a.hdr", *lines, kind="FORMAT=32-bit_rle_xyze"))


@pytest.mark.parametrize("kind", ["software=x", "# FORMAT=32-bit_rle_rgbe", "# 32-bit_rle_rgbe"])
def test_a_format_that_is_not_stated_is_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InputError, match=r"a\.hdr: .*found another format"):
        read_hdr(written(tmp_path / "a.hdr", kind=kind))


@pytest.mark.parametrize("kind", ["FORMAT=32-bit_rle_rgbe\r", "FORMAT = 32-bit_rle_rgbe "])
def test_a_format_may_have_blanks_around_it(tmp_path: Path, kind: str) -> None:
    read_hdr(written(tmp_path / "a.hdr", kind=kind))


def test_bytes_after_the_last_row_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.hdr: .*1 bytes after its last row"):
        read_hdr(written(tmp_path / "a.hdr", pixels=bytes([128] * 4) + b"x"))


def test_runs_of_the_old_packing_are_refused(tmp_path: Path) -> None:
    """How often a pixel is repeated was read as a pixel, where enough bytes followed."""
    path = written(tmp_path / "a.hdr", pixels=bytes([128, 128, 128, 128, 1, 1, 1, 1]))
    path.write_bytes(path.read_bytes().replace(b"+X 1\n", b"+X 2\n"))
    with pytest.raises(InputError, match=r"a\.hdr: .*runs of pixels, as before 1991"):
        read_hdr(path)
