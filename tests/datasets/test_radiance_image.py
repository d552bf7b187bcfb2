"""What the header of a Radiance picture says of its pixels."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.datasets.scans.radiance_image import read_hdr
from rgspipe.errors import InputError


def written(path: Path, *lines: str) -> Path:
    """A picture of one pixel, (128.5 / 256) in all colours as it is stored."""
    header = "\n".join(["#?RADIANCE", *lines, "FORMAT=32-bit_rle_rgbe"])
    path.write_bytes(header.encode() + b"\n\n-Y 1 +X 1\n" + bytes([128] * 4))
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
